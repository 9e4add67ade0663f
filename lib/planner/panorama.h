#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "lib/geometry/waypoint.h"
#include "lib/occupancy/occupancy_map.h"
#include "lib/planner/free_places.h"
#include "lib/planner/voxel_marks.h"
#include "lib/scan/sonar.h"

namespace vog {

/// What there is to see from a place at each heading.
using GainByHeading = std::array<float, kHeadings>;

/// Estimates ViewGain's Visible() for all headings of a place at once: rays all around, some
/// degrees apart, each unknown voxel weighted by how many of its size the rays pass between. The
/// sonar is taken to be at the vehicle's middle, at its own height.
class Panorama {
 public:
  Panorama(const SonarOptions& sonar, double range_m, const Eigen::AlignedBox3d& box_W);

  /// Adds up the unknown voxels to see at each heading, each with its `weight`, by rays that end
  /// where `ends` says, see SeeUnknown(). Cost: one ray cast a ray, see rays().
  GainByHeading Look(const OccupancyMap& map, const Vec3& p_W,
                     const std::function<double(const VoxelKey&)>& weight,
                     const OccupancyMap::EndsRay& ends = nullptr) const;

  std::size_t rays() const { return directions_W_.size(); }

 private:
  static constexpr int kSectors = 48;

  double min_range_m_, range_m_, mount_z_m_, half_fov_rad_, ray_solid_angle_sr_;
  Eigen::AlignedBox3d box_W_;
  std::vector<Vec3> directions_W_;
  mutable VoxelMarks marks_;
  mutable std::vector<VoxelKey> unknown_;  // Kept for its memory.
};

}  // namespace vog
