#include "lib/submap/submap.h"

namespace vog {

std::vector<VoxelKey> OccupiedVoxels(const BrickGrid& grid, LogOddsUnits occupied_from,
                                     int min_neighbours) {
  const auto is_occupied = [&](LogOddsUnits units) {
    return units != kUnknownUnits && units >= occupied_from;
  };
  std::vector<VoxelKey> voxels;
  grid.ForEach([&](const VoxelKey& key, LogOddsUnits units) {
    if (!is_occupied(units)) return;
    int neighbours = -1;  // The voxel itself is counted below.
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          neighbours += is_occupied(grid.Get({key.x + dx, key.y + dy, key.z + dz}));
    if (neighbours >= min_neighbours) voxels.push_back(key);
  });
  return voxels;
}

std::vector<Vec3> OccupiedPoints(const BrickGrid& grid, LogOddsUnits occupied_from,
                                 int min_neighbours) {
  std::vector<Vec3> points_M;
  for (const VoxelKey& key : OccupiedVoxels(grid, occupied_from, min_neighbours))
    points_M.push_back(grid.grid().CenterOf(key));
  return points_M;
}

}  // namespace vog
