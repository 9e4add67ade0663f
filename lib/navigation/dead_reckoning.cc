#include "lib/navigation/dead_reckoning.h"

#include <cmath>
#include <numbers>

namespace vog {
namespace {

void Propagate(const Pose3& X_OB_now, const Mat3& added, OdometrySample& state) {
  state.covariance = ComposePlanarCovariance(state.covariance, Ominus(state.X_OB, X_OB_now), added);
  state.X_OB = X_OB_now;
}

}  // namespace

VehicleNavTracker::VehicleNavTracker(const DriftOptions& drift, double scan_period_s,
                                     std::int64_t segment, const JumpLimits& limits)
    : drift_(drift), scan_period_s_(scan_period_s), segment_(segment), limits_(limits) {}

bool VehicleNavTracker::IsJump(const VehicleNavRecord& record) const {
  const double dt_s = ToSeconds(record.time - last_->time);
  const Pose3 motion = Ominus(last_->X_OB, record.X_OB);
  const Vec3 expected = 0.5 * dt_s * (last_->velocity_B_m_s + record.velocity_B_m_s);
  const double turned = 0.5 * dt_s * (last_->yaw_rate_rad_s + record.yaw_rate_rad_s);
  return (motion.translation() - expected).head<2>().norm() >
             limits_.distance_m + limits_.speed_m_s * dt_s ||
         std::abs(WrapAngle(YawOf(motion) - turned)) >
             limits_.turn_rad + limits_.turn_rate_rad_s * dt_s;
}

void VehicleNavTracker::BeginAnew(std::int64_t origin) {
  origin_ = origin;
  if (!last_) return;
  last_.reset();
  ++segment_;
}

OdometrySample VehicleNavTracker::Add(const VehicleNavRecord& record) {
  if (!last_ || vehicle_origin_ != record.origin) {
    BeginAnew(record.origin);
  } else if (IsJump(record)) {
    BeginAnew(record.time.time_since_epoch().count());
    ++jumps_;
  }
  vehicle_origin_ = record.origin;
  OdometrySample sample = last_.value_or(OdometrySample{});
  const double steps = last_ ? ToSeconds(record.time - last_->time) / scan_period_s_ : 0;
  if (!last_) sample.X_OB = record.X_OB;
  Propagate(record.X_OB, steps * drift_.StepCovariance(scan_period_s_), sample);
  sample.time = record.time;
  sample.origin = origin_;
  sample.segment = segment_;
  sample.velocity_B_m_s = record.velocity_B_m_s;
  sample.yaw_rate_rad_s = record.yaw_rate_rad_s;
  last_ = sample;
  return sample;
}

bool VelocityGate::Agree(const DvlRecord& a, const DvlRecord& b) const {
  const double dt_s = std::abs(ToSeconds(b.time - a.time));
  const double noise_m_s = options_.gate_sigmas * std::numbers::sqrt2 * options_.dvl_sigma_m_s;
  return (b.velocity_B_m_s - a.velocity_B_m_s).norm() <=
         options_.max_acceleration_m_s2 * dt_s + noise_m_s;
}

bool VelocityGate::Passes(const DvlRecord& record) {
  if (taken_ && !Agree(*taken_, record)) {
    ++outliers_;
    in_a_row_ = outlier_ && Agree(*outlier_, record) ? in_a_row_ + 1 : 1;
    outlier_ = record;
    if (in_a_row_ < options_.believed_outliers) return false;
  }
  taken_ = record;
  outlier_.reset();
  in_a_row_ = 0;
  return true;
}

DeadReckoner::DeadReckoner(const DeadReckoningOptions& options, std::int64_t segment)
    : options_(options), gate_(options) {
  state_.origin = state_.segment = segment;
}

void DeadReckoner::SetFix(const Pose3& X_OB) {
  if (!is_started_) state_.X_OB = X_OB;
}

void DeadReckoner::Add(const DvlRecord& record) {
  if (record.valid && gate_.Passes(record)) velocity_ = record;
}

void DeadReckoner::Add(const DepthRecord& record) {
  const double measured_m = -record.depth_m;
  z_m_ = z_m_ ? *z_m_ + options_.depth_gain * (measured_m - *z_m_) : measured_m;
}

bool DeadReckoner::HasLock(Time time) const {
  return velocity_ && ToSeconds(time - velocity_->time) <= options_.lock_lost_after_s;
}

std::optional<OdometrySample> DeadReckoner::Add(const ImuRecord& record) {
  if (!z_m_ || (is_started_ && record.time <= state_.time)) return std::nullopt;
  const double dt_s = is_started_ ? ToSeconds(record.time - state_.time) : 0;
  const bool has_lock = HasLock(record.time);
  state_.velocity_B_m_s = has_lock ? velocity_->velocity_B_m_s : Vec3::Zero();
  // The rate about the vertical, from body rates [Fossen 2011, eq. 2.26].
  const Vec3& rates = record.angular_velocity_B_rad_s;
  state_.yaw_rate_rad_s =
      (std::sin(record.roll_rad) * rates.y() + std::cos(record.roll_rad) * rates.z()) /
      std::cos(record.pitch_rad);
  const double yaw_rad = YawOf(state_.X_OB) + dt_s * state_.yaw_rate_rad_s;
  const RollPitchYaw angles{record.roll_rad, record.pitch_rad, yaw_rad};
  const Vec3 moved_O = MakePose(Vec3::Zero(), angles) * Vec3(dt_s * state_.velocity_B_m_s);
  Vec3 position_O = state_.X_OB.translation() + moved_O;
  z_m_ = *z_m_ + moved_O.z();
  position_O.z() = *z_m_;

  const double sigma_m_s = has_lock ? options_.dvl_sigma_m_s : options_.no_lock_sigma_m_s;
  // One velocity's error lasts for a period; without lock it lasts for as long as lock is lost.
  const double correlated_s = has_lock ? options_.dvl_period_s : 60;
  const double moved = sigma_m_s * sigma_m_s * correlated_s * dt_s;
  const double turned = options_.gyro_noise_rad_rt_s * options_.gyro_noise_rad_rt_s * dt_s;
  Propagate(MakePose(position_O, angles), Vec3(moved, moved, turned).asDiagonal(), state_);
  state_.time = record.time;
  if (!is_started_) {
    is_started_ = true;
    return std::nullopt;
  }
  return state_;
}

}  // namespace vog
