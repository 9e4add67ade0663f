#pragma once

#include <vector>

#include "lib/base/config.h"
#include "lib/base/time.h"
#include "lib/geometry/pose.h"

namespace vog {

/// What the servo under the sonar does: keeps the fan level or swings it up and down.
enum class TiltMode { kFixed, kSweep };

/// The profiling sonar: a fan of narrow beams in its x-y plane, on a pitch servo. Defaults: Ho et
/// al. 2018, Table I, on a DIDSON with a profiling lens; the sweep is ours.
struct SonarOptions {
  int beams = 96;
  double fov_deg = 29;
  double beam_thickness_deg = 1;
  double min_range_m = 0.375;
  double max_range_m = 11;
  double rate_hz = 5;
  TiltMode tilt = TiltMode::kSweep;
  double tilt_amplitude_deg = 35;
  double tilt_rate_deg_s = 10;
  Vec3 mount_m = {0.045, -0.22, 0};

  void Visit(OptionsVisitor& v) {
    v("beams", beams, Between(2, 1024), "beams of the fan");
    v("fov_deg", fov_deg, Between(1, 180), "horizontal angle that the fan covers");
    v("beam_thickness_deg", beam_thickness_deg, Between(0.01, 30), "vertical angle of a beam");
    v("min_range_m", min_range_m, Between(0, 100), "start of the window; nothing nearer is seen");
    v("max_range_m", max_range_m, Between(0.1, 500), "end of the window");
    v("rate_hz", rate_hz, Between(0.1, 100), "scans a second");
    v("tilt", tilt, Names<TiltMode>{{TiltMode::kFixed, "fixed"}, {TiltMode::kSweep, "sweep"}},
      "the pitch servo keeps the fan level, or swings it");
    v("tilt_amplitude_deg", tilt_amplitude_deg, Between(0, 90), "the sweep's end above and below");
    v("tilt_rate_deg_s", tilt_rate_deg_s, Between(0.1, 360), "speed of the sweep");
    v("mount_m", mount_m, Between(-10, 10), "the servo's place in the body frame");
  }

  /// @throws UsageError if the window is empty.
  void Validate() const;

  Duration period() const { return FromSeconds(1 / rate_hz); }
};

/// Bearing of each beam in S [rad], to the left positive, from right to left.
std::vector<double> BeamBearings(const SonarOptions& options);

/// Direction of a beam in S.
Vec3 BeamDirection(double bearing_rad);

/// X_BS when the fan points `tilt_rad` above the level.
Pose3 SonarPose(const SonarOptions& options, double tilt_rad);

/// Of the servo, up and down and back; 0 where it does not sweep.
double SweepPeriod_s(const SonarOptions& options);

/// The servo's angle at `time`, up positive: level, or a triangle wave that starts level and
/// upwards.
double TiltAt(const SonarOptions& options, Time time);

}  // namespace vog
