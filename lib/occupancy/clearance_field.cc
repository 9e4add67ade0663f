#include "lib/occupancy/clearance_field.h"

#include <algorithm>
#include <cmath>

namespace vog {

ClearanceField::ClearanceField(const OccupancyMap& map, double max_m, Obstacles obstacles)
    : map_(map), max_m_(max_m), obstacles_(obstacles), revision_(map.revision()) {}

double ClearanceField::DistanceFrom(const VoxelKey& voxel) {
  if (revision_ != map_.revision()) ForgetWhatChanged();
  const auto [found, is_new] = distance_m_.try_emplace(voxel, 0);
  if (is_new) found->second = Measure(voxel);
  return found->second;
}

void ClearanceField::ForgetWhatChanged() {
  const auto changed_W = map_.ChangedSince(revision_);
  revision_ = map_.revision();
  if (!changed_W) {
    distance_m_.clear();
    return;
  }
  std::erase_if(distance_m_, [&](const auto& entry) {
    const Vec3 center_W = map_.grid().CenterOf(entry.first);
    const double reach_m = max_m_ + map_.grid().voxel_size_m();
    return std::any_of(changed_W->begin(), changed_W->end(), [&](const auto& box_W) {
      return box_W.exteriorDistance(center_W) <= reach_m;
    });
  });
}

double ClearanceField::Measure(const VoxelKey& voxel) {
  const double side_m = map_.grid().voxel_size_m();
  const auto reach = static_cast<std::int32_t>(std::ceil(max_m_ / side_m));
  map_.NotFreeIn({{voxel.x - reach, voxel.y - reach, voxel.z - reach},
                  {voxel.x + reach, voxel.y + reach, voxel.z + reach}},
                 not_free_);
  // From a centre to a cube that many voxels away along an axis.
  const auto gap = [&](std::int32_t a, std::int32_t b) {
    return a == b ? 0 : (std::abs(a - b) - 0.5) * side_m;
  };
  double least_m2 = max_m_ * max_m_;
  for (const VoxelAnswer& obstacle : not_free_) {
    if (obstacles_ == Obstacles::kOccupied && !map_.IsOccupied(obstacle.log_odds)) continue;
    const double x_m = gap(voxel.x, obstacle.key.x), y_m = gap(voxel.y, obstacle.key.y),
                 z_m = gap(voxel.z, obstacle.key.z);
    least_m2 = std::min(least_m2, x_m * x_m + y_m * y_m + z_m * z_m);
  }
  return std::sqrt(least_m2);
}

}  // namespace vog
