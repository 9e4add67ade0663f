#include "lib/navigation/dead_reckoning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace vog {
namespace {

/// Without bottom lock an assumed velocity's error lasts for as long as lock is lost.
constexpr double kNoLock_s = 60;

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
  const double noise_m_s =
      options_.gate_sigmas * std::numbers::sqrt2 * options_.errors.dvl_sigma_m_s;
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
    : options_(options), filter_(options.errors), gate_(options) {
  state_.origin = state_.segment = segment;
}

void DeadReckoner::SetFix(const Pose3& X_OB) {
  if (!is_started_) state_.X_OB = X_OB;
}

void DeadReckoner::Add(const DvlRecord& record) {
  if (!record.valid || !gate_.Passes(record)) return;
  velocity_ = record;
  unused_velocity_B_m_s_ = record.velocity_B_m_s;
}

void DeadReckoner::Add(const DepthRecord& record) { unused_z_m_ = -record.depth_m; }

bool DeadReckoner::HasLock(Time time) const {
  return velocity_ && ToSeconds(time - velocity_->time) <= options_.lock_lost_after_s;
}

std::optional<OdometrySample> DeadReckoner::Add(const ImuRecord& record) {
  if (!is_started_) {
    if (unused_z_m_) Start(record);
    return std::nullopt;
  }
  if (record.time <= state_.time) return std::nullopt;
  const double dt_s = ToSeconds(record.time - state_.time);
  const Vec3 velocity_O_before_m_s = state_.X_OB.linear() * state_.velocity_B_m_s;
  filter_.Predict(dt_s, 0.5 * (rates_B_rad_s_ + record.angular_velocity_B_rad_s));
  state_.time = record.time;
  Measure(record);
  const Pose3 X_OA = MakePose(Vec3::Zero(), filter_.angles());  // A: the body's axes, at O.
  const Vec3 velocity_O_m_s = 0.5 * (velocity_O_before_m_s + X_OA * state_.velocity_B_m_s);
  Vec3 position_O = state_.X_OB.translation() + dt_s * velocity_O_m_s;
  position_O.z() = filter_.z_m();
  Propagate(MakePose(position_O, filter_.angles()), AddedCovariance(dt_s), state_);
  reckoned_s_ += dt_s;
  return state_;
}

void DeadReckoner::Start(const ImuRecord& record) {
  const RollPitchYaw angles{record.roll_rad, record.pitch_rad, YawOf(state_.X_OB)};
  Vec3 position_O = state_.X_OB.translation();
  position_O.z() = *unused_z_m_;
  filter_.Start(angles, *std::exchange(unused_z_m_, std::nullopt));
  filter_.ForgetVelocity(options_.no_lock_sigma_m_s);
  state_.X_OB = MakePose(position_O, angles);
  state_.time = record.time;
  Measure(record);
  is_started_ = true;
}

/// Gives the filter what came since the record before.
void DeadReckoner::Measure(const ImuRecord& record) {
  filter_.MeasureAttitude(record.roll_rad, record.pitch_rad);
  if (unused_velocity_B_m_s_) filter_.MeasureVelocity(*unused_velocity_B_m_s_);
  if (!HasLock(record.time)) filter_.ForgetVelocity(options_.no_lock_sigma_m_s);
  if (unused_z_m_) filter_.MeasureHeight(*unused_z_m_, options_.gate_sigmas, options_.depth_gain);
  unused_velocity_B_m_s_.reset();
  unused_z_m_.reset();
  rates_B_rad_s_ = record.angular_velocity_B_rad_s;
  state_.velocity_B_m_s = filter_.velocity_B_m_s();
  state_.yaw_rate_rad_s = filter_.YawRate(rates_B_rad_s_);
}

/// How much the covariance of (x, y) grows in a second, on the body side.
Eigen::Matrix2d DeadReckoner::PositionNoise(double correlated_s) const {
  const auto white = [](double sigma_m_s, double lasts_s) -> Eigen::Matrix2d {
    return lasts_s * sigma_m_s * sigma_m_s * Eigen::Matrix2d::Identity();
  };
  if (!HasLock(state_.time)) return white(options_.no_lock_sigma_m_s, kNoLock_s);
  // A velocity's error lasts until the next one that is taken.
  const double age_s = ToSeconds(state_.time - velocity_->time);
  const Eigen::Vector2d v = state_.velocity_B_m_s.head<2>();
  const auto& P = filter_.covariance();
  const double scale_variance = P(InstrumentFilter::kDvlScale, InstrumentFilter::kDvlScale);
  return white(options_.errors.dvl_sigma_m_s, std::max(options_.dvl_period_s, age_s)) +
         correlated_s * (scale_variance * v * v.transpose() +
                         P.block<2, 2>(InstrumentFilter::kDvlBias, InstrumentFilter::kDvlBias));
}

/// Of (x, y, yaw), over the `dt_s` that end now, on the body side.
Mat3 DeadReckoner::AddedCovariance(double dt_s) const {
  const double correlated_s = 2 * std::min(reckoned_s_ + 0.5 * dt_s, options_.bias_horizon_s);
  const double gyro_noise = options_.errors.gyro_noise_rad_rt_s;
  Mat3 density = Mat3::Zero();
  density.topLeftCorner<2, 2>() = PositionNoise(correlated_s);
  density(2, 2) = gyro_noise * gyro_noise + correlated_s * filter_.YawBiasVariance();
  return dt_s * density;
}

}  // namespace vog
