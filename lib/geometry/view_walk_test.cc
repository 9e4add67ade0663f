#include "lib/geometry/view_walk.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "lib/base/random.h"

namespace vog {
namespace {

struct Step {
  VoxelKey key;
  double entered_m;
  bool operator==(const Step&) const = default;
};
using Steps = std::vector<Step>;

struct Ray {
  Vec3 origin, direction;
  double length_m;
};

class ViewWalkTest : public testing::TestWithParam<WalkForm> {
 protected:
  void SetUp() override {
    if (!Supports(GetParam())) GTEST_SKIP() << "not on this processor";
  }

  Vec3 Point(double half_side_m) {
    return Vec3::NullaryExpr([&] { return random_.Uniform(-half_side_m, half_side_m); });
  }

  /// Some along axes or planes, some from borders of voxels, some short.
  Ray AnyRay() {
    Ray ray{Point(5), Point(1), random_.Chance(0.2) ? 0 : random_.Uniform(0, 8)};
    for (int axis = 0; axis < 3; ++axis) {
      if (random_.Chance(0.2)) ray.direction[axis] = 0;
      if (random_.Chance(0.2)) ray.origin[axis] = grid_.voxel_size_m() * (random_.Index(20) - 10);
    }
    if (random_.Chance(0.1)) ray.direction = Vec3::Ones();  // Through edges.
    if (ray.direction.norm() < 0.1) ray.direction = -Vec3::UnitY();
    ray.direction.normalize();
    return ray;
  }

  Steps Literal(const Ray& ray) const {
    Steps steps;
    WalkVoxels(grid_, ray.origin, ray.direction, ray.length_m,
               [&](const VoxelKey& key, double entered_m) {
                 steps.push_back({key, entered_m});
                 return true;
               });
    return steps;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  VoxelGrid grid_{0.125};
};

TEST_P(ViewWalkTest, AllRaysPassTheVoxelsOfTheirWalks) {
  ViewWalk dut(grid_, GetParam());
  for (int view = 0; view < 500; ++view) {
    const int rays = 1 + view % ViewWalk::kLanes;
    dut.Clear();
    std::vector<Steps> expected(rays), walked(rays);
    for (int i = 0; i < rays; ++i) {
      const Ray ray = AnyRay();
      dut.Start(i, ray.origin, ray.direction, ray.length_m);
      expected[i] = Literal(ray);
    }
    std::array<bool, ViewWalk::kLanes> is_over{};
    for (int round = 0; round < 60; ++round) {
      const ViewWalk::Round& next = dut.Next();
      for (int step = 0; step < ViewWalk::kRound; ++step)
        for (int i = 0; i < ViewWalk::kLanes; ++i) {
          is_over[i] = std::isnan(next.entered_m[step][i]);
          if (i >= rays || is_over[i]) continue;
          walked[i].push_back({ViewWalk::Unpack(next.key[step][i]), next.entered_m[step][i]});
        }
    }
    for (const bool ended : is_over) EXPECT_TRUE(ended);
    for (int i = 0; i < rays; ++i) EXPECT_TRUE(walked[i] == expected[i]) << "ray " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Forms, ViewWalkTest,
                         testing::Values(WalkForm::kBaseline, WalkForm::kAvx2));

TEST(ViewWalkKeysTest, PackedKeysComeBackAsFarAsRaysAreHeld) {
  const VoxelGrid grid(0.5);
  Random random(2, "view walk keys");
  for (int i = 0; i < 1000; ++i) {
    const auto coordinate = [&] { return random.Index(1 << 21) - (1 << 20); };
    const std::int32_t x = coordinate(), y = coordinate(), z = coordinate();
    EXPECT_EQ(ViewWalk::Unpack(ViewWalk::Pack({x, y, z})), (VoxelKey{x, y, z}));
  }
  const double edge_m = (1 << 20) * 0.5;
  EXPECT_TRUE(ViewWalk::Holds(grid, {0, -edge_m + 15, 0}, 10));
  EXPECT_FALSE(ViewWalk::Holds(grid, {0, -edge_m + 5, 0}, 10));
  EXPECT_FALSE(ViewWalk::Holds(grid, {0, 0, edge_m}, 1));
}

}  // namespace
}  // namespace vog
