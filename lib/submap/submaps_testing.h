#pragma once

#include <map>
#include <memory>
#include <utility>

#include "lib/base/random.h"
#include "lib/submap/submap.h"

/// Random grids, submaps and poses for tests.
namespace vog {

/// The content of a grid, as plainly as it can be told.
using VoxelTable = std::map<VoxelKey, int>;

inline VoxelTable TableOf(const BrickGrid& grid) {
  VoxelTable table;
  grid.ForEach([&](const VoxelKey& key, LogOddsUnits units) { table[key] = units; });
  return table;
}

inline BrickGrid GridOf(double voxel_size_m, const VoxelTable& table) {
  BrickGrid grid(voxel_size_m);
  for (const auto& [key, units] : table) grid.At(key) = static_cast<LogOddsUnits>(units);
  return grid;
}

/// Voxels of random units within `half_side` of the origin along each axis, among them some equal
/// cubes, which an octree prunes.
inline VoxelTable RandomTable(int voxels, int half_side, Random& random) {
  const auto index = [&] { return random.Index(2 * half_side) - half_side; };
  VoxelTable table;
  for (int i = 0; i < voxels; ++i)
    table[{index(), index(), index()}] = random.Index(177) - 64;  // Within the default clamps.
  for (int cube = 0; cube < 5; ++cube) {
    const int side = 2 << random.Index(2), units = random.Index(177) - 64;
    const VoxelKey corner{index() & -side, index() & -side, index() & -side};
    for (int i = 0; i < side * side * side; ++i)
      table[{corner.x + i % side, corner.y + i / side % side, corner.z + i / side / side}] = units;
  }
  return table;
}

inline Vec3 RandomPoint(double half_side_m, Random& random) {
  const auto coordinate = [&] { return random.Uniform(-half_side_m, half_side_m); };
  const double x = coordinate(), y = coordinate();
  return {x, y, coordinate()};
}

inline Pose3 RandomPose(double half_side_m, Random& random) {
  const Vec3 position_m = RandomPoint(half_side_m, random);
  const double roll = random.Uniform(-3, 3), pitch = random.Uniform(-1.5, 1.5);
  return MakePose(position_m, {roll, pitch, random.Uniform(-3, 3)});
}

/// A submap with something in each of its fields.
inline SubmapPtr MakeSubmap(SubmapId id, BrickGrid grid, Random& random) {
  auto submap = std::make_shared<Submap>(Submap{.base = {},
                                                .first_scan = FromUtime(1'000'000 * (id + 1)),
                                                .last_scan = FromUtime(1'000'000 * (id + 1) + 7),
                                                .scans = 10 + id,
                                                .grid = std::move(grid)});
  submap->base.id = id;
  submap->base.odometry.time = submap->first_scan;
  submap->base.odometry.origin = 2;
  submap->base.odometry.segment = 3;
  submap->X_ML = RandomPose(2, random);
  submap->base.odometry.X_OB = RandomPose(10, random);
  submap->base.edge.X_PM = RandomPose(1, random);
  const Mat3 root = Mat3::NullaryExpr([&] { return random.Gaussian(0.1); });
  submap->drift = root * root.transpose();
  submap->base.odometry.covariance = 2 * submap->drift;
  const Mat6 wide = Mat6::NullaryExpr([&] { return random.Gaussian(0.1); });
  submap->base.edge.covariance = wide * wide.transpose();
  return submap;
}

inline SubmapPtr RandomSubmap(SubmapId id, double voxel_size_m, Random& random) {
  return MakeSubmap(id, GridOf(voxel_size_m, RandomTable(1500, 10, random)), random);
}

}  // namespace vog
