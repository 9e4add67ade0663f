#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "lib/base/config.h"
#include "lib/base/time.h"
#include "lib/geometry/pose.h"

namespace vog {

/// Dead reckoning at one moment. Its x, y and yaw drift; z, roll and pitch are measured absolutely.
struct OdometrySample {
  Time time;
  /// Names the frame O: poses of one origin can be compared, whatever their segments.
  std::int64_t origin = 0;
  /// A stretch over which `covariance` was kept without a break; grows with each.
  std::int64_t segment = 0;
  Pose3 X_OB = Pose3::Identity();
  /// Of (x, y, yaw) [m, m, rad] since the segment began, perturbation on the body side.
  Mat3 covariance = Mat3::Zero();
  Vec3 velocity_B_m_s = Vec3::Zero();
  double yaw_rate_rad_s = 0;
};

/// Eq. 8's noise, scaled as the formula reads (`kLiteral`, dt * N(0, Sigma)) or so that its printed
/// unit m^2/s comes out (`kRandomWalk`, sqrt(dt) * N(0, Sigma)).
enum class DriftScaling { kLiteral, kRandomWalk };

/// How fast the dead-reckoned x, y and yaw drift, and how well z, roll and pitch are measured.
/// Defaults: Ho et al. 2018, section V-A.
struct DriftOptions {
  DriftScaling scaling = DriftScaling::kLiteral;
  double variance_x_m2_s = 0.00138;
  double variance_y_m2_s = 0.00138;
  double variance_yaw_rad2_s = 1e-7;
  double sigma_z_m = 0.01;
  double sigma_roll_pitch_rad = 0.2 * 3.14159265358979323846 / 180;

  void Visit(OptionsVisitor& v) {
    v("scaling", scaling,
      Names<DriftScaling>{{DriftScaling::kLiteral, "literal"},
                          {DriftScaling::kRandomWalk, "random_walk"}},
      "noise of eq. 8 a scan: dt * N(0, Sigma) as printed, or sqrt(dt) * N(0, Sigma)");
    v("variance_x_m2_s", variance_x_m2_s, Between(0, 10), "Sigma of eq. 8, forward");
    v("variance_y_m2_s", variance_y_m2_s, Between(0, 10), "Sigma of eq. 8, to the left");
    v("variance_yaw_rad2_s", variance_yaw_rad2_s, Between(0, 1), "Sigma of eq. 8, yaw");
    v("sigma_z_m", sigma_z_m, Between(1e-4, 1), "standard deviation of the absolute depth");
    v("sigma_roll_pitch_rad", sigma_roll_pitch_rad, Between(1e-5, 0.5),
      "standard deviation of the absolute roll and pitch");
  }

  /// Covariance of (x, y, yaw) that one step of `step_s` adds, on the body side.
  Mat3 StepCovariance(double step_s) const;
};

/// The adjoint of a motion restricted to (x, y, yaw), for a body that stays nearly level.
Mat3 PlanarAdjointOf(const Pose3& X);

/// A covariance of (x, y, yaw) among all six coordinates; 0 elsewhere.
Mat6 PlanarTo6(const Mat3& planar);
/// The rows and columns of (x, y, yaw).
Mat3 PlanarOf(const Mat6& full);

/// The largest horizontal standard deviation in the covariance of a pose, in whatever direction
/// [m].
double HorizontalSigma(const Mat6& covariance);

/// Covariance of (x, y, yaw) of X_AC = X_AB * X_BC from those of its two parts.
Mat3 ComposePlanarCovariance(const Mat3& covariance_AB, const Pose3& X_BC,
                             const Mat3& covariance_BC);

/// Covariance of the motion between two samples of one segment: what was added after the first.
Mat3 MotionCovariance(const OdometrySample& from, const OdometrySample& to);

/// Recent odometry, for the pose at a moment between two samples.
class OdometryHistory {
 public:
  /// Where the vehicle was between samples farther apart is not known well enough to map from.
  static constexpr Duration kLongestGap = std::chrono::seconds(1);

  /// @pre samples of one segment come in order of time. A new segment forgets the old one.
  void Add(const OdometrySample& sample);

  /// Linear between the samples on both sides of `time`; nothing outside them or in too long a gap.
  std::optional<OdometrySample> At(Time time) const;

  /// Forgets samples that no moment at or after `time` needs.
  void ForgetBefore(Time time);

  bool empty() const { return samples_.empty(); }
  const OdometrySample& newest() const { return samples_.back(); }
  const OdometrySample& oldest() const { return samples_.front(); }

 private:
  std::deque<OdometrySample> samples_;
};

}  // namespace vog
