#include "lib/vogmap/merged_grid.h"

namespace vog {

BrickGrid MergedGrid(const VogMap& map) {
  BrickGrid merged(map.grid().voxel_size_m());
  const Eigen::AlignedBox3d bounds_W = map.Bounds();
  if (bounds_W.isEmpty()) return merged;
  const VoxelBox all = VoxelsOf(map.grid(), bounds_W);
  constexpr int kSide = BrickGrid::kBrickSide;
  const auto aligned = [](std::int32_t index) { return index & ~(kSide - 1); };
  std::vector<float> log_odds;
  for (std::int32_t z = aligned(all.min.z); z <= all.max.z; z += kSide) {
    for (std::int32_t y = aligned(all.min.y); y <= all.max.y; y += kSide)
      for (std::int32_t x = aligned(all.min.x); x <= all.max.x; x += kSide) {
        const VoxelBox brick{{x, y, z}, {x + kSide - 1, y + kSide - 1, z + kSide - 1}};
        map.LogOddsIn(brick, log_odds);
        std::size_t i = 0;
        ForEachVoxel(brick, [&](const VoxelKey& voxel) {
          const float value = log_odds[i++];
          if (IsKnown(value)) merged.At(voxel) = ToUnits(value);
        });
      }
    map.ReleaseCache();  // No layer is asked twice.
  }
  return merged;
}

}  // namespace vog
