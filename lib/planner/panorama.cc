#include "lib/planner/panorama.h"

#include <cmath>
#include <numbers>

namespace vog {
namespace {

/// Mean area of a cube's shadow, of one with sides of 1 [Cauchy 1832].
constexpr double kShadowOfACube = 1.5;

}  // namespace

Panorama::Panorama(const SonarOptions& sonar, double range_m, const Eigen::AlignedBox3d& box_W)
    : min_range_m_(sonar.min_range_m),
      range_m_(std::min(range_m, sonar.max_range_m)),
      mount_z_m_(sonar.mount_m.z()),
      half_fov_rad_(ToRadians(sonar.fov_deg) / 2),
      box_W_(box_W) {
  const double step_rad = 2 * std::numbers::pi / kSectors;
  const double tilt_rad = sonar.tilt == TiltMode::kSweep ? ToRadians(sonar.tilt_amplitude_deg) : 0;
  const int rows = static_cast<int>(std::lround(2 * tilt_rad / step_rad)) + 1;
  const double height_rad = std::max(2 * tilt_rad, ToRadians(sonar.beam_thickness_deg)) / rows;
  ray_solid_angle_sr_ = step_rad * height_rad;
  for (int row = 0; row < rows; ++row) {
    const double elevation_rad = (row + 0.5 - 0.5 * rows) * height_rad;
    for (int i = 0; i < kSectors; ++i) {
      const double azimuth_rad = (i + 0.5) * step_rad;
      directions_W_.emplace_back(std::cos(elevation_rad) * std::cos(azimuth_rad),
                                 std::cos(elevation_rad) * std::sin(azimuth_rad),
                                 std::sin(elevation_rad));
    }
  }
}

GainByHeading Panorama::Look(const OccupancyMap& map, const Vec3& p_W,
                             const std::function<double(const VoxelKey&)>& weight,
                             const OccupancyMap::EndsRay& ends) const {
  GainByHeading gains{};
  const Vec3 origin_W = p_W + Vec3(0, 0, mount_z_m_);
  const Vec3 reach = Vec3::Constant(range_m_);
  const Eigen::AlignedBox3d counted_W =
      Eigen::AlignedBox3d(origin_W - reach, origin_W + reach).intersection(box_W_);
  if (counted_W.isEmpty()) return gains;
  marks_.Begin(VoxelsOf(map.grid(), counted_W));
  map.SeeUnknown(origin_W, directions_W_, min_range_m_, range_m_, ends, unknown_);
  std::array<double, kSectors> by_sector{};
  const double voxel_m = map.grid().voxel_size_m();
  for (const VoxelKey& key : unknown_) {
    if (!marks_.Mark(key)) continue;
    const Vec3 away = map.grid().CenterOf(key) - origin_W;
    const double turns = std::atan2(away.y(), away.x()) / (2 * std::numbers::pi);
    const int sector = static_cast<int>(std::floor(turns * kSectors) + kSectors) % kSectors;
    // How many rays a voxel so far away meets, in the mean; some meet none.
    const double rays =
        kShadowOfACube * voxel_m * voxel_m / (away.squaredNorm() * ray_solid_angle_sr_);
    by_sector[static_cast<std::size_t>(sector)] += weight(key) / -std::expm1(-rays);
  }
  for (int heading = 0; heading < kHeadings; ++heading) {
    const double yaw = YawOfHeading(heading);
    for (int sector = 0; sector < kSectors; ++sector) {
      constexpr double kWidth = 2 * std::numbers::pi / kSectors;
      // The share of the sector that the fan covers.
      const double off = std::abs(WrapAngle((sector + 0.5) * kWidth - yaw));
      const double share = std::clamp((half_fov_rad_ + kWidth / 2 - off) / kWidth, 0.0, 1.0);
      gains[static_cast<std::size_t>(heading)] +=
          static_cast<float>(share * by_sector[static_cast<std::size_t>(sector)]);
    }
  }
  return gains;
}

}  // namespace vog
