#pragma once

#include <cstdint>
#include <vector>

#include "lib/geometry/waypoint.h"
#include "lib/occupancy/occupancy_map.h"
#include "lib/planner/voxel_marks.h"
#include "lib/scan/sonar.h"

namespace vog {

/// Visible(M, xi) of eq. 7: the distinct unknown voxels inside the exploration box that the sonar,
/// with its whole sweep, would see from a pose within a range; occupied voxels block.
class ViewGain {
 public:
  ViewGain(const SonarOptions& sonar, double range_m, double ray_step_deg,
           const Eigen::AlignedBox3d& box_W);

  /// Cost: one ray cast a ray, see rays().
  int Visible(const OccupancyMap& map, const Waypoint& at) const {
    return static_cast<int>(See(map, at).size());
  }
  /// The voxels themselves, each once, by rays that end where `ends` says, see SeeUnknown(); valid
  /// until the next call.
  const std::vector<VoxelKey>& See(const OccupancyMap& map, const Waypoint& at,
                                   const OccupancyMap::EndsRay& ends = nullptr) const;

  std::size_t rays() const { return directions_B_.size(); }

 private:
  double min_range_m_, range_m_;
  Vec3 p_BS_m_;
  std::vector<Vec3> directions_B_;
  Eigen::AlignedBox3d box_W_;
  mutable VoxelMarks marks_;
  mutable std::vector<Vec3> directions_W_;  // Of the last view; kept for their memory.
  mutable std::vector<VoxelKey> unknown_;   // Likewise.
};

}  // namespace vog
