#include "lib/geometry/voxel_grid.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "lib/base/random.h"

namespace vog {
namespace {

Vec3 RandomPoint(double half_side, Random& random) {
  return Vec3::NullaryExpr([&] { return random.Uniform(-half_side, half_side); });
}

/// The length of the segment inside a voxel (slab test); negative where it stays outside.
double LengthInside(const VoxelGrid& grid, const VoxelKey& key, const Vec3& origin,
                    const Vec3& direction, double length_m) {
  const Vec3 half = Vec3::Constant(grid.voxel_size_m() / 2);
  const Vec3 min = grid.CenterOf(key) - half, max = grid.CenterOf(key) + half;
  double enter = 0, leave = length_m;
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0) {
      if (origin[i] < min[i] || origin[i] > max[i]) return -1;
      continue;
    }
    const double a = (min[i] - origin[i]) / direction[i], b = (max[i] - origin[i]) / direction[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return leave - enter;
}

struct Step {
  VoxelKey key;
  double entered_m;
};

std::vector<Step> Walk(const VoxelGrid& grid, const Vec3& origin, const Vec3& direction,
                       double length_m) {
  std::vector<Step> steps;
  WalkVoxels(grid, origin, direction, length_m, [&](const VoxelKey& key, double entered_m) {
    steps.push_back({key, entered_m});
    return steps.size() < 10000;
  });
  return steps;
}

TEST(VoxelGridTest, APointLiesInTheVoxelOfItsKey) {
  Random random(1, "voxel_grid");
  for (const double size_m : {0.05, 0.095, 1.0, 3.7}) {
    const VoxelGrid dut(size_m);
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = RandomPoint(50, random);
      EXPECT_LE((dut.CenterOf(dut.KeyOf(p)) - p).cwiseAbs().maxCoeff(), size_m / 2 + 1e-12);
      const VoxelKey key{random.Index(60000) - 30000, random.Index(60000) - 30000, 5};
      EXPECT_EQ(dut.KeyOf(dut.CenterOf(key)), key);
    }
    EXPECT_EQ(dut.KeyOf(Vec3::Zero()), (VoxelKey{0, 0, 0}));
    EXPECT_EQ(dut.KeyOf(Vec3::Constant(-1e-9)), (VoxelKey{-1, -1, -1}));
  }
}

TEST(VoxelGridTest, HashesTellNeighboursApart) {
  std::set<std::size_t> hashes;
  for (int x = -10; x < 10; ++x)
    for (int y = -10; y < 10; ++y)
      for (int z = -10; z < 10; ++z) hashes.insert(std::hash<VoxelKey>{}({x, y, z}));
  EXPECT_EQ(hashes.size(), 8000u);
}

TEST(WalkVoxelsTest, WalksTheVoxelsThatTheSegmentMeetsAndNoOthers) {
  Random random(2, "voxel_grid");
  const VoxelGrid grid(0.5);
  for (int round = 0; round < 200; ++round) {
    const Vec3 origin = RandomPoint(2, random);
    Vec3 direction = RandomPoint(1, random);
    for (int i = 0; i < 3; ++i)
      if (random.Chance(0.25)) direction[i] = 0;  // Parallel to a face.
    if (direction.norm() < 0.1) continue;
    direction.normalize();
    const double length_m = random.Uniform(0, 4);
    std::set<VoxelKey> walked;
    for (const Step& step : Walk(grid, origin, direction, length_m)) {
      EXPECT_TRUE(walked.insert(step.key).second) << "twice";
      EXPECT_GE(LengthInside(grid, step.key, origin, direction, length_m), -1e-9);
    }
    const int reach = 14;
    for (int x = -reach; x < reach; ++x)
      for (int y = -reach; y < reach; ++y)
        for (int z = -reach; z < reach; ++z)
          if (LengthInside(grid, {x, y, z}, origin, direction, length_m) > 1e-9) {
            EXPECT_EQ(walked.count({x, y, z}), 1u);
          }
  }
}

TEST(WalkVoxelsTest, GoesFromFaceToFaceInOrder) {
  Random random(3, "voxel_grid");
  const VoxelGrid grid(0.095);
  for (int round = 0; round < 100; ++round) {
    const Vec3 origin = RandomPoint(2, random), direction = RandomPoint(1, random).normalized();
    const auto steps = Walk(grid, origin, direction, 5);
    EXPECT_EQ(steps.front().key, grid.KeyOf(origin));
    EXPECT_EQ(steps.front().entered_m, 0);
    EXPECT_EQ(steps.back().key, grid.KeyOf(origin + 5 * direction));
    for (std::size_t i = 1; i < steps.size(); ++i) {
      const VoxelKey &a = steps[i - 1].key, &b = steps[i].key;
      EXPECT_EQ(std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z), 1);
      EXPECT_GE(steps[i].entered_m, steps[i - 1].entered_m);
      const Vec3 entry = origin + steps[i].entered_m * direction;
      EXPECT_NEAR((entry - grid.CenterOf(b)).cwiseAbs().maxCoeff(), 0.095 / 2, 1e-9);
    }
  }
}

TEST(WalkVoxelsTest, AlongAnAxisFromAVoxelsBorder) {
  const VoxelGrid grid(1);
  std::vector<VoxelKey> keys;
  for (const Step& step : Walk(grid, {0, 0.5, 0.5}, -Vec3::UnitX(), 2.5)) keys.push_back(step.key);
  EXPECT_EQ(keys, (std::vector<VoxelKey>{{0, 0, 0}, {-1, 0, 0}, {-2, 0, 0}, {-3, 0, 0}}));
  keys.clear();
  for (const Step& step : Walk(grid, {0, 0.5, 0.5}, Vec3::UnitX(), 2)) keys.push_back(step.key);
  EXPECT_EQ(keys, (std::vector<VoxelKey>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}));
}

TEST(WalkVoxelsTest, StopsWhenTold) {
  int visits = 0;
  WalkVoxels(VoxelGrid(0.1), Vec3::Zero(), Vec3::UnitX(), 100,
             [&](const VoxelKey&, double) { return ++visits < 5; });
  EXPECT_EQ(visits, 5);
  visits = 0;
  WalkVoxels(VoxelGrid(0.1), {0.05, 0.05, 0.05}, Vec3::UnitX(), 0, [&](const VoxelKey&, double) {
    ++visits;
    return true;
  });
  EXPECT_EQ(visits, 1);  // The voxel of the origin.
}

}  // namespace
}  // namespace vog
