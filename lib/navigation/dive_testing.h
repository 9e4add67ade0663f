#pragma once

#include <cmath>
#include <cstdint>

#include "lib/base/random.h"
#include "lib/navigation/dead_reckoning.h"

namespace vog {

inline InstrumentErrors LargerBiases(InstrumentErrors errors, double factor) {
  errors.dvl_bias_sigma_m_s *= factor;
  errors.dvl_scale_sigma *= factor;
  errors.gyro_bias_sigma_rad_s *= factor;
  errors.gyro_bias_walk_rad_s_rt_s *= factor;
  return errors;
}

/// A vehicle that turns, sways, dives and rocks, and its instruments with the noise and the biases
/// that InstrumentErrors tell, drawn anew for each seed. Gyro and depth at 20 Hz, DVL at 5 Hz.
class Dive {
 public:
  Dive(const InstrumentErrors& errors, std::uint64_t seed)
      : errors_(errors), random_(seed, "dive") {
    truth_[InstrumentFilter::kHeight] = -5;
    for (int i = 0; i < 3; ++i) {
      truth_[InstrumentFilter::kGyroBias + i] = random_.Gaussian(errors.gyro_bias_sigma_rad_s);
      truth_[InstrumentFilter::kDvlBias + i] = random_.Gaussian(errors.dvl_bias_sigma_m_s);
    }
    truth_[InstrumentFilter::kDvlScale] = random_.Gaussian(errors.dvl_scale_sigma);
  }

  OdometrySample Run(DeadReckoner& dut, double seconds) {
    OdometrySample newest;
    for (const std::int64_t end = step_ + std::llround(seconds * kRate_hz); step_ < end; ++step_) {
      const Vec3 rates = Move();
      if (step_ % 4 == 0 && has_lock) dut.Add(Dvl());
      dut.Add(DepthRecord{time(), step_, -z_m() + random_.Gaussian(errors_.depth_sigma_m)});
      if (const auto sample = dut.Add(Imu(rates))) newest = *sample;
    }
    return newest;
  }

  /// As the filter's state.
  const InstrumentFilter::State& Truth() const { return truth_; }
  const Vec3& velocity_B_m_s() const { return velocity_B_m_s_; }
  Pose3 X_OB() const { return MakePose({xy_.x(), xy_.y(), z_m()}, angles()); }
  Time time() const { return Time(FromSeconds(step_ / kRate_hz)); }

  bool has_lock = true;

 private:
  static constexpr double kRate_hz = 20;

  double z_m() const { return truth_[InstrumentFilter::kHeight]; }
  RollPitchYaw angles() const { return {truth_[0], truth_[1], truth_[2]}; }
  static RollPitchYaw AnglesAt(double t) {
    return {0.03 * std::sin(0.7 * t), 0.03 * std::sin(0.5 * t), 1.4 * std::sin(0.07 * t)};
  }
  static Vec3 VelocityAt(double t) {
    return {0.2 + 0.05 * std::sin(0.3 * t), 0.05 * std::cos(0.2 * t), 0.15 * std::sin(0.1 * t)};
  }
  static Vec3 RatesAt(double t) {
    const double roll_rate = 0.03 * 0.7 * std::cos(0.7 * t);
    const double pitch_rate = 0.03 * 0.5 * std::cos(0.5 * t);
    const double yaw_rate = 1.4 * 0.07 * std::cos(0.07 * t);
    const RollPitchYaw angles = AnglesAt(t);
    const double s = std::sin(angles.roll), c = std::cos(angles.roll);
    const double along = std::cos(angles.pitch) * yaw_rate;
    return {roll_rate - std::sin(angles.pitch) * yaw_rate, c * pitch_rate + s * along,
            -s * pitch_rate + c * along};
  }

  /// To the next step; returns the body rates there.
  Vec3 Move() {
    const double t = step_ / kRate_hz, dt = step_ == 0 ? 0 : 1 / kRate_hz;
    const double middle = t - 0.5 * dt;
    const Vec3 moved = MakePose(Vec3::Zero(), AnglesAt(middle)) * Vec3(dt * VelocityAt(middle));
    xy_ += moved.head<2>();
    truth_[InstrumentFilter::kHeight] += moved.z();
    const RollPitchYaw angles = AnglesAt(t);
    truth_.head<3>() << angles.roll, angles.pitch, angles.yaw;
    velocity_B_m_s_ = VelocityAt(t);
    truth_.segment<3>(InstrumentFilter::kVelocity) =
        (1 + truth_[InstrumentFilter::kDvlScale]) * velocity_B_m_s_ +
        truth_.segment<3>(InstrumentFilter::kDvlBias);
    for (int i = 0; i < 3; ++i)
      truth_[InstrumentFilter::kGyroBias + i] +=
          random_.Gaussian(errors_.gyro_bias_walk_rad_s_rt_s * std::sqrt(dt));
    return RatesAt(t);
  }

  DvlRecord Dvl() {
    const Vec3 noise = random_.GaussianVector(Vec3::Constant(errors_.dvl_sigma_m_s));
    return {time(), step_, truth_.segment<3>(InstrumentFilter::kVelocity) + noise, true};
  }

  ImuRecord Imu(const Vec3& rates) {
    const double noise = errors_.gyro_noise_rad_rt_s * std::sqrt(kRate_hz);
    return {time(), step_, truth_[0] + random_.Gaussian(errors_.attitude_sigma_rad),
            truth_[1] + random_.Gaussian(errors_.attitude_sigma_rad),
            rates + truth_.segment<3>(InstrumentFilter::kGyroBias) +
                random_.GaussianVector(Vec3::Constant(noise))};
  }

  InstrumentErrors errors_;
  Random random_;
  InstrumentFilter::State truth_ = InstrumentFilter::State::Zero();
  Vec3 velocity_B_m_s_ = Vec3::Zero();
  Eigen::Vector2d xy_ = Eigen::Vector2d::Zero();
  std::int64_t step_ = 0;
};

}  // namespace vog
