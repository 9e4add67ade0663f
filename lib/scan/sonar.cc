#include "lib/scan/sonar.h"

#include <cmath>

namespace vog {

void SonarOptions::Validate() const {
  if (min_range_m >= max_range_m)
    throw UsageError("sonar.min_range_m must be smaller than sonar.max_range_m");
}

std::vector<double> BeamBearings(const SonarOptions& options) {
  std::vector<double> bearings(static_cast<std::size_t>(options.beams));
  for (std::size_t i = 0; i < bearings.size(); ++i)
    bearings[i] = ToRadians(options.fov_deg) *
                  ((static_cast<double>(i) + 0.5) / static_cast<double>(bearings.size()) - 0.5);
  return bearings;
}

Vec3 BeamDirection(double bearing_rad) { return {std::cos(bearing_rad), std::sin(bearing_rad), 0}; }

Pose3 SonarPose(const SonarOptions& options, double tilt_rad) {
  return MakePose(options.mount_m, {0, -tilt_rad, 0});
}

double SweepPeriod_s(const SonarOptions& options) {
  return options.tilt == TiltMode::kFixed
             ? 0
             : 4 * options.tilt_amplitude_deg / options.tilt_rate_deg_s;
}

double TiltAt(const SonarOptions& options, Time time) {
  if (options.tilt == TiltMode::kFixed || options.tilt_amplitude_deg == 0) return 0;
  // In quarters of a period: up from 0 to 1, down to -1 at 3, up again to 0 at 4.
  const double quarters =
      std::fmod(ToSeconds(time) * options.tilt_rate_deg_s / options.tilt_amplitude_deg, 4);
  const double wave = quarters < 1 ? quarters : quarters < 3 ? 2 - quarters : quarters - 4;
  return ToRadians(options.tilt_amplitude_deg * wave);
}

}  // namespace vog
