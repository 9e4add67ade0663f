#include "lib/planner/view_gain.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

/// Angles from -half to half, at most `step` apart.
std::vector<double> Spread(double half_rad, double step_rad) {
  const int intervals = std::max(0, static_cast<int>(std::ceil(2 * half_rad / step_rad)));
  std::vector<double> angles;
  for (int i = 0; i <= intervals; ++i)
    angles.push_back(intervals == 0 ? 0 : half_rad * (2.0 * i / intervals - 1));
  return angles;
}

}  // namespace

ViewGain::ViewGain(const SonarOptions& sonar, double range_m, double ray_step_deg,
                   const Eigen::AlignedBox3d& box_W)
    : min_range_m_(sonar.min_range_m),
      range_m_(std::min(range_m, sonar.max_range_m)),
      p_BS_m_(sonar.mount_m),
      box_W_(box_W) {
  const double step_rad = ToRadians(ray_step_deg);
  const double tilt_rad = sonar.tilt == TiltMode::kSweep ? ToRadians(sonar.tilt_amplitude_deg) : 0;
  for (const double tilt : Spread(tilt_rad, step_rad))
    for (const double bearing : Spread(ToRadians(sonar.fov_deg) / 2, step_rad))
      directions_B_.push_back(SonarPose(sonar, tilt).linear() * BeamDirection(bearing));
}

const std::vector<VoxelKey>& ViewGain::See(const OccupancyMap& map, const Waypoint& at,
                                           const OccupancyMap::EndsRay& ends) const {
  const Pose3 X_WB = at.X_WB();
  const Vec3 origin_W = X_WB * p_BS_m_;
  const Vec3 reach = Vec3::Constant(range_m_);
  const Eigen::AlignedBox3d view_W(origin_W - reach, origin_W + reach);
  const Eigen::AlignedBox3d counted_W = view_W.intersection(box_W_);
  unknown_.clear();
  if (counted_W.isEmpty()) return unknown_;
  marks_.Begin(VoxelsOf(map.grid(), counted_W));
  directions_W_.clear();
  for (const Vec3& direction_B : directions_B_)
    directions_W_.push_back(X_WB.linear() * direction_B);
  map.SeeUnknown(origin_W, directions_W_, min_range_m_, range_m_, ends, unknown_);
  std::erase_if(unknown_, [this](const VoxelKey& key) { return !marks_.Mark(key); });
  return unknown_;
}

}  // namespace vog
