#include "sim/sensors/drifted_navigation.h"

#include <cmath>

#include "lib/base/random.h"

namespace vog {
namespace {

/// A small motion (x, y, yaw).
Pose3 PlanarMotion(const Vec3& motion) {
  return MakePose({motion.x(), motion.y(), 0}, {0, 0, motion.z()});
}

}  // namespace

DriftedNavigation::DriftedNavigation(const DriftOptions& options, Duration scan_period,
                                     std::uint64_t seed, const Vec3& start_error)
    : options_(options),
      scan_period_(scan_period),
      seed_(seed),
      start_error_(start_error),
      motion_sigma_(options.StepCovariance(ToSeconds(scan_period)).diagonal().cwiseSqrt()) {}

DriftedNavigation::Noise DriftedNavigation::NoiseOf(std::int64_t step) const {
  Random random(seed_, "drift", step);
  const Vec3 motion = random.GaussianVector(motion_sigma_);
  const Vec3 absolute = random.GaussianVector(
      {options_.sigma_z_m, options_.sigma_roll_pitch_rad, options_.sigma_roll_pitch_rad});
  return {motion, absolute};
}

DriftedNavigation::Step DriftedNavigation::FirstStep(Time time, const Pose3& X_WB) const {
  Noise first = NoiseOf(0);
  first.motion.setZero();  // Nothing moved before the first step.
  Pose3 drifted_pose = Level(X_WB) * PlanarMotion({0, 0, start_error_[2]});
  drifted_pose.translation().head<2>() += start_error_.head<2>();
  return {time, 0, Level(X_WB), drifted_pose, first, NoiseOf(1)};
}

DriftedNavigation::Step DriftedNavigation::NextStep(const Pose3& X_WB) const {
  const std::int64_t number = step_->number + 1;
  return {step_->time + scan_period_, number,      Level(X_WB),
          Drifted(X_WB, 1),           step_->next, NoiseOf(number + 1)};
}

/// Eq. 8 for a step, or for the first `fraction` of it.
Pose3 DriftedNavigation::Drifted(const Pose3& X_WB, double fraction) const {
  const Pose3 motion = Ominus(step_->true_pose, Level(X_WB));
  return step_->drifted_pose * motion * PlanarMotion(fraction * step_->next.motion);
}

VehicleNavRecord DriftedNavigation::Sample(Time time, std::int64_t sequence,
                                           const VehicleState& truth) {
  if (!step_) step_ = FirstStep(time, truth.X_WB);
  while (time >= step_->time + scan_period_) {
    const double fraction =
        ToSeconds(step_->time + scan_period_ - last_time_) / ToSeconds(time - last_time_);
    step_ = NextStep(fraction < 1 ? Interpolate(last_X_WB_, truth.X_WB, fraction) : truth.X_WB);
  }
  last_time_ = time;
  last_X_WB_ = truth.X_WB;

  const double fraction = ToSeconds(time - step_->time) / ToSeconds(scan_period_);
  const Pose3 drifted = Drifted(truth.X_WB, fraction);
  const Vec3 absolute = (1 - fraction) * step_->here.absolute + fraction * step_->next.absolute;
  const RollPitchYaw angles = AnglesOf(truth.X_WB);
  const Vec3 drift_rate =
      (fraction > 0 ? step_->next : step_->here).motion / ToSeconds(scan_period_);
  VehicleNavRecord record;
  record.time = time;
  record.sequence = sequence;
  record.X_OB = MakePose({drifted.translation().x(), drifted.translation().y(),
                          truth.X_WB.translation().z() + absolute[0]},
                         {angles.roll + absolute[1], angles.pitch + absolute[2], YawOf(drifted)});
  record.velocity_B_m_s = truth.velocity_B_m_s + Vec3(drift_rate.x(), drift_rate.y(), 0);
  record.yaw_rate_rad_s = truth.angular_velocity_B_rad_s.z() + drift_rate.z();
  return record;
}

}  // namespace vog
