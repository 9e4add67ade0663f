#include "lib/navigation/instrument_filter.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace vog {
namespace {

/// Euler angles lose a degree of freedom at 90 degrees of pitch; no vehicle of ours comes near it.
constexpr double kLeastCosine = 0.1;

double SecantOf(double pitch_rad) { return 1 / std::max(std::cos(pitch_rad), kLeastCosine); }

/// Rates of roll, pitch and yaw from body rates [Fossen 2011, eq. 2.26].
Mat3 EulerRatesOf(double roll_rad, double pitch_rad) {
  const double s = std::sin(roll_rad), c = std::cos(roll_rad), secant = SecantOf(pitch_rad);
  const double tangent = std::sin(pitch_rad) * secant;
  Mat3 T;
  T << 1, s * tangent, c * tangent,  //
      0, c, -s,                      //
      0, s * secant, c * secant;
  return T;
}

/// The vertical of O in the body's axes.
Vec3 UpOf(double roll_rad, double pitch_rad) {
  return {-std::sin(pitch_rad), std::cos(pitch_rad) * std::sin(roll_rad),
          std::cos(pitch_rad) * std::cos(roll_rad)};
}

double Squared(double x) { return x * x; }

}  // namespace

InstrumentFilter::InstrumentFilter(const InstrumentErrors& errors) : errors_(errors) {
  const auto set = [this](int at, int size, double sigma) {
    covariance_.diagonal().segment(at, size).setConstant(Squared(sigma));
  };
  set(kGyroBias, 3, errors.gyro_bias_sigma_rad_s);
  set(kDvlScale, 1, errors.dvl_scale_sigma);
  set(kDvlBias, 3, errors.dvl_bias_sigma_m_s);
}

void InstrumentFilter::Start(const RollPitchYaw& angles, double z_m) {
  state_.head<3>() << angles.roll, angles.pitch, angles.yaw;
  state_[kHeight] = z_m;
  covariance_.diagonal().head<2>().setConstant(Squared(errors_.attitude_sigma_rad));
  covariance_(kHeight, kHeight) = Squared(errors_.depth_sigma_m);
}

Vec3 InstrumentFilter::VelocityOf(const State& state) {
  return (state.segment<3>(kVelocity) - state.segment<3>(kDvlBias)) / (1 + state[kDvlScale]);
}

InstrumentFilter::State InstrumentFilter::Derivative(const State& state,
                                                     const Vec3& measured_rates_B_rad_s) {
  State rates = State::Zero();
  rates.head<3>() = EulerRatesOf(state[kRoll], state[kPitch]) *
                    (measured_rates_B_rad_s - state.segment<3>(kGyroBias));
  rates[kHeight] = UpOf(state[kRoll], state[kPitch]).dot(VelocityOf(state));
  return rates;
}

InstrumentFilter::Covariance InstrumentFilter::Jacobian(const State& state,
                                                        const Vec3& measured_rates_B_rad_s) {
  const double roll = state[kRoll], pitch = state[kPitch];
  const double s = std::sin(roll), c = std::cos(roll), secant = SecantOf(pitch);
  const double tangent = std::sin(pitch) * secant;
  const Vec3 rates = measured_rates_B_rad_s - state.segment<3>(kGyroBias);
  const Vec3 velocity = VelocityOf(state);
  const double across = c * rates.y() - s * rates.z(), along = s * rates.y() + c * rates.z();

  Covariance F = Covariance::Zero();
  F(kRoll, kRoll) = tangent * across;
  F(kPitch, kRoll) = -along;
  F(kYaw, kRoll) = secant * across;
  F(kRoll, kPitch) = secant * secant * along;
  F(kYaw, kPitch) = secant * tangent * along;
  F.block<3, 3>(kRoll, kGyroBias) = -EulerRatesOf(roll, pitch);
  F(kHeight, kRoll) = std::cos(pitch) * (c * velocity.y() - s * velocity.z());
  F(kHeight, kPitch) =
      -std::cos(pitch) * velocity.x() - std::sin(pitch) * (s * velocity.y() + c * velocity.z());
  const Vec3 up = UpOf(roll, pitch) / (1 + state[kDvlScale]);
  F.block<1, 3>(kHeight, kVelocity) = up.transpose();
  F.block<1, 3>(kHeight, kDvlBias) = -up.transpose();
  F(kHeight, kDvlScale) = -up.dot(velocity);
  return F;
}

void InstrumentFilter::Predict(double dt_s, const Vec3& measured_rates_B_rad_s) {
  const Covariance step = Covariance::Identity() + dt_s * Jacobian(state_, measured_rates_B_rad_s);
  state_ += dt_s * Derivative(state_, measured_rates_B_rad_s);
  state_[kYaw] = WrapAngle(state_[kYaw]);
  covariance_ = step * covariance_ * step.transpose();
  const auto add = [&](int at, double noise) {
    covariance_.diagonal().segment<3>(at).array() += Squared(noise) * dt_s;
  };
  add(kRoll, errors_.gyro_noise_rad_rt_s);
  add(kGyroBias, errors_.gyro_bias_walk_rad_s_rt_s);
  add(kVelocity, errors_.acceleration_noise_m_s_rt_s);
}

/// In Joseph's form, which keeps the covariance one.
template <int kRows>
void InstrumentFilter::Correct(const Eigen::Matrix<double, kRows, 1>& innovation,
                               const Eigen::Matrix<double, kRows, kSize>& H, double sigma) {
  using Square = Eigen::Matrix<double, kRows, kRows>;
  const Square R = Squared(sigma) * Square::Identity();
  const Eigen::Matrix<double, kSize, kRows> PHt = covariance_ * H.transpose();
  const Square S = H * PHt + R;
  const Eigen::Matrix<double, kSize, kRows> K = PHt * S.inverse();
  const Covariance rest = Covariance::Identity() - K * H;
  state_ += K * innovation;
  covariance_ = rest * covariance_ * rest.transpose() + K * R * K.transpose();
}

void InstrumentFilter::MeasureAttitude(double roll_rad, double pitch_rad) {
  Eigen::Matrix<double, 2, kSize> H = Eigen::Matrix<double, 2, kSize>::Zero();
  H(0, kRoll) = H(1, kPitch) = 1;
  Correct<2>({WrapAngle(roll_rad - state_[kRoll]), WrapAngle(pitch_rad - state_[kPitch])}, H,
             errors_.attitude_sigma_rad);
}

void InstrumentFilter::MeasureVelocity(const Vec3& velocity_B_m_s) {
  Eigen::Matrix<double, 3, kSize> H = Eigen::Matrix<double, 3, kSize>::Zero();
  H.block<3, 3>(0, kVelocity).setIdentity();
  Correct<3>(velocity_B_m_s - state_.segment<3>(kVelocity), H, errors_.dvl_sigma_m_s);
}

void InstrumentFilter::MeasureHeight(double z_m, double gate_sigmas, double gain) {
  const double innovation = z_m - state_[kHeight];
  const double variance = covariance_(kHeight, kHeight) + Squared(errors_.depth_sigma_m);
  if (Squared(innovation) > Squared(gate_sigmas) * variance) {
    state_[kHeight] += gain * innovation;
    return;
  }
  Eigen::Matrix<double, 1, kSize> H = Eigen::Matrix<double, 1, kSize>::Zero();
  H[kHeight] = 1;
  Correct<1>(Eigen::Matrix<double, 1, 1>(innovation), H, errors_.depth_sigma_m);
}

void InstrumentFilter::ForgetVelocity(double sigma_m_s) {
  state_.segment<3>(kVelocity) = state_.segment<3>(kDvlBias);
  covariance_.middleRows<3>(kVelocity) = covariance_.middleRows<3>(kDvlBias).eval();
  covariance_.middleCols<3>(kVelocity) = covariance_.middleCols<3>(kDvlBias).eval();
  covariance_.diagonal().segment<3>(kVelocity).array() += Squared(sigma_m_s);
}

double InstrumentFilter::YawRate(const Vec3& measured_rates_B_rad_s) const {
  return EulerRatesOf(state_[kRoll], state_[kPitch])
      .row(2)
      .dot(measured_rates_B_rad_s - state_.segment<3>(kGyroBias));
}

double InstrumentFilter::YawBiasVariance() const {
  const auto row = EulerRatesOf(state_[kRoll], state_[kPitch]).row(2).eval();
  return row * covariance_.block<3, 3>(kGyroBias, kGyroBias) * row.transpose();
}

}  // namespace vog
