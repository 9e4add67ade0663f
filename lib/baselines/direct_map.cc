#include "lib/baselines/direct_map.h"

#include "lib/baselines/culling.h"
#include "lib/vogmap/log_odds_sum.h"

namespace vog {

template <class Extent>
DirectMap::Submaps DirectMap::SubmapsIn(const Extent& extent) const {
  Submaps submaps;
  for (const auto& [id, placed] : placed()) {
    if (extent.Touches(placed.bounds_M, placed.X_MW)) submaps.push_back(&placed);
  }
  return submaps;
}

float DirectMap::LogOddsAt(const Submaps& submaps, const Vec3& p_W) const {
  LogOddsSum sum;
  // A grid looks at its bounds first.
  const auto add = [&](const BrickGrid& grid, const Pose3& X_MW) {
    sum.Add(grid.Get(grid.grid().KeyOf(X_MW * p_W)));
  };
  for (const PlacedSubmap* placed : submaps) add(placed->submap->grid, placed->X_MW);
  if (open() != nullptr) add(*open(), X_open_W());
  return sum.Clamped(model());
}

void DirectMap::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  const Submaps submaps = SubmapsIn(Ball(grid(), points_W));
  for (std::size_t i = 0; i < points_W.size(); ++i) log_odds[i] = LogOddsAt(submaps, points_W[i]);
}

void DirectMap::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  const Submaps submaps = SubmapsIn(Ball(grid(), voxels));
  ReadVoxels(voxels, log_odds,
             [&](const VoxelKey& voxel) { return LogOddsAt(submaps, grid().CenterOf(voxel)); });
}

void DirectMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  const Submaps submaps = SubmapsIn(Ball(grid(), box));
  ReadBox(box, log_odds,
          [&](const VoxelKey& voxel) { return LogOddsAt(submaps, grid().CenterOf(voxel)); });
}

void DirectMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                        std::vector<RayVoxel>& ray) const {
  const Submaps submaps = SubmapsIn(Segment(grid(), origin_W, direction_W, range_m));
  WalkRay(origin_W, direction_W, range_m, ray,
          [&](const VoxelKey& voxel) { return LogOddsAt(submaps, grid().CenterOf(voxel)); });
}

}  // namespace vog
