#include "lib/submap/ray_walker.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <limits>
#include <set>

#include "lib/base/random.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;
constexpr int kKeyOrigin = 32768;

octomap::point3d ToOctomap(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

VoxelKey FromOctomap(const octomap::OcTreeKey& key) {
  return {key[0] - kKeyOrigin, key[1] - kKeyOrigin, key[2] - kKeyOrigin};
}

/// The walk of OctoMap itself; it writes a warning for rays beyond its keys, which are kept from
/// it.
std::vector<VoxelKey> OctomapsWalk(const octomap::OcTree& tree, const Ray& ray) {
  const octomap::point3d from = ToOctomap(ray.from), to = ToOctomap(ray.to);
  octomap::OcTreeKey key;
  octomap::KeyRay keys;
  if (tree.coordToKeyChecked(from, key) && tree.coordToKeyChecked(to, key))
    tree.computeRayKeys(from, to, keys);
  std::vector<VoxelKey> walk;
  for (const octomap::OcTreeKey& passed : keys) walk.push_back(FromOctomap(passed));
  return walk;
}

/// What the walker visits, in the order of the first visits.
std::vector<VoxelKey> WalkOf(RayWalker& walker, const std::vector<Ray>& rays) {
  std::vector<VoxelKey> walk;
  std::set<VoxelKey> seen;
  walker.Walk(rays, [&](const VoxelKey& key) {
    if (seen.insert(key).second) walk.push_back(key);
  });
  return walk;
}

class RayWalkerTest : public testing::TestWithParam<WalkForm> {
 protected:
  void SetUp() override {
    if (!Supports(GetParam())) GTEST_SKIP() << "not on this processor";
  }

  Eigen::Vector3f Point(double half_side_m) {
    Eigen::Vector3f p;
    for (float& coordinate : p)
      coordinate = static_cast<float>(random_.Uniform(-half_side_m, half_side_m));
    return p;
  }

  /// A point whose coordinates are, as nearly as floats can, on borders or centres of voxels.
  Eigen::Vector3f PointOnBorders(int half_side) {
    Eigen::Vector3f p;
    for (float& coordinate : p)
      coordinate =
          static_cast<float>(0.5 * kVoxel_m * (random_.Index(4 * half_side) - 2 * half_side));
    return p;
  }

  void ExpectOctomapsWalk(const Ray& ray) {
    const std::vector<VoxelKey> expected = OctomapsWalk(tree_, ray);
    ASSERT_EQ(WalkOf(dut_, {ray}), expected)
        << ray.from.transpose() << " to " << ray.to.transpose();
    voxels_ += expected.size();
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  octomap::OcTree tree_{kVoxel_m};
  RayWalker dut_{kVoxel_m, GetParam()};
  std::size_t voxels_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Forms, RayWalkerTest,
                         testing::Values(WalkForm::kBaseline, WalkForm::kAvx2));

TEST_P(RayWalkerTest, WalksAsOctomapAnywhere) {
  for (int i = 0; i < 5000; ++i) ExpectOctomapsWalk({Point(6), Point(6)});
  // No farther: OctoMap writes beyond its buffer when a ray passes more than 100,000 voxels.
  for (int i = 0; i < 30; ++i) ExpectOctomapsWalk({Point(1500), Point(1500)});
  EXPECT_GT(voxels_, 5000u * 50);
}

TEST_P(RayWalkerTest, WalksAsOctomapAlongAxesAndPlanes) {
  for (int i = 0; i < 3000; ++i) {
    Ray ray{i % 2 == 0 ? Point(4) : PointOnBorders(40), Point(4)};
    for (int axis = 0; axis < 3; ++axis)
      if (random_.Chance(0.5)) ray.to[axis] = ray.from[axis];
    ExpectOctomapsWalk(ray);
  }
}

TEST_P(RayWalkerTest, WalksAsOctomapAlongDiagonals) {
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3f from = PointOnBorders(20);
    const auto side_m = static_cast<float>(random_.Index(40) * 0.5 * kVoxel_m);
    Eigen::Vector3f way = Eigen::Vector3f::Constant(side_m);
    for (float& part : way) part *= static_cast<float>(random_.Index(3) - 1);
    ExpectOctomapsWalk({from, from + way});
  }
}

TEST_P(RayWalkerTest, WalksAsOctomapFromBorderToBorder) {
  for (int i = 0; i < 5000; ++i) ExpectOctomapsWalk({PointOnBorders(30), PointOnBorders(30)});
  // A float above or below a border.
  for (int i = 0; i < 5000; ++i) {
    Ray ray{PointOnBorders(10), PointOnBorders(10)};
    for (Eigen::Vector3f* p : {&ray.from, &ray.to})
      for (float& coordinate : *p)
        coordinate = std::nextafter(coordinate, random_.Chance(0.5) ? 1e9f : -1e9f);
    ExpectOctomapsWalk(ray);
  }
}

TEST_P(RayWalkerTest, WalksAsOctomapOnShortWays) {
  for (int i = 0; i < 5000; ++i) {
    const double reach_m = std::pow(10, random_.Uniform(-9, 0));
    const Eigen::Vector3f from = i % 2 == 0 ? Point(3) : PointOnBorders(20);
    ExpectOctomapsWalk({from, from + Point(reach_m)});
  }
  const Eigen::Vector3f p = Point(3);
  EXPECT_TRUE(WalkOf(dut_, {{p, p}}).empty());
}

TEST_P(RayWalkerTest, EndsWhereALengthVanishes) {
  const float tiny = 1e-30f;
  ExpectOctomapsWalk({{tiny, 0, 0}, {-tiny, 0, 0}});
  // Here OctoMap would never end.
  EXPECT_EQ(WalkOf(dut_, {{{tiny, tiny, tiny}, {-tiny, -tiny, -tiny}}}),
            (std::vector<VoxelKey>{{0, 0, 0}}));
}

TEST_P(RayWalkerTest, WalksAsOctomapAtTheRimOfItsKeys) {
  const double rim_m = kKeyOrigin * kVoxel_m;
  int walked = 0;
  for (int i = 0; i < 5000; ++i) {
    Ray ray{Point(0.3), Point(0.3)};
    for (int axis = 0; axis < 3; ++axis) {
      const int side = random_.Index(3) - 1;
      ray.from[axis] += static_cast<float>(side * rim_m);
      ray.to[axis] += static_cast<float>(side * rim_m);
    }
    ExpectOctomapsWalk(ray);
    walked += !WalkOf(dut_, {ray}).empty();
  }
  EXPECT_GT(walked, 500);
  EXPECT_LT(walked, 4500);
}

TEST_P(RayWalkerTest, LeavesOutRaysBeyondOctomapsKeys) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const Eigen::Vector3f near(1, 2, 3);
  for (const float far : {3200.0f, -3200.0f, 1e10f, -1e30f, kInfinity, -kInfinity, NAN})
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3f beyond = near;
      beyond[axis] = far;
      EXPECT_FALSE(dut_.KeyOf(beyond));
      EXPECT_TRUE(WalkOf(dut_, {{near, beyond}, {beyond, near}, {beyond, beyond}}).empty());
    }
}

TEST_P(RayWalkerTest, KeysAreOctomaps) {
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3f p = i % 2 == 0 ? Point(3150) : PointOnBorders(1 << 15);
    octomap::OcTreeKey theirs;
    const bool has_key = tree_.coordToKeyChecked(ToOctomap(p), theirs);
    const std::optional<VoxelKey> key = dut_.KeyOf(p);
    ASSERT_EQ(key.has_value(), has_key) << p.transpose();
    if (key) {
      ASSERT_EQ(*key, FromOctomap(theirs)) << p.transpose();
    }
  }
}

TEST_P(RayWalkerTest, ManyRaysPassWhatEachOfThemPasses) {
  for (int scan = 0; scan < 200; ++scan) {
    std::vector<Ray> rays;
    std::set<VoxelKey> expected;
    const Eigen::Vector3f from = Point(2), ahead = Point(4);
    for (int i = random_.Index(40); i >= 0; --i) {
      rays.push_back({from, random_.Chance(0.1) ? from : ahead + Point(scan % 2 == 0 ? 0.3 : 4)});
      for (const VoxelKey& key : OctomapsWalk(tree_, rays.back())) expected.insert(key);
    }
    std::set<VoxelKey> passed;
    std::size_t visits = 0;
    dut_.Walk(rays, [&](const VoxelKey& key) {
      passed.insert(key);
      ++visits;
    });
    ASSERT_EQ(passed, expected);
    ASSERT_LE(visits, 2 * expected.size());
  }
}

TEST_P(RayWalkerTest, FormsVisitTheSameInTheSameOrder) {
  RayWalker baseline(kVoxel_m, WalkForm::kBaseline);
  for (int scan = 0; scan < 100; ++scan) {
    std::vector<Ray> rays;
    for (int i = 0; i < 50; ++i) rays.push_back({Point(3), Point(3)});
    ASSERT_EQ(WalkOf(dut_, rays), WalkOf(baseline, rays));
  }
}

}  // namespace
}  // namespace vog
