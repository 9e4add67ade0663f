#pragma once

#include <Eigen/Core>

#include "lib/base/config.h"
#include "lib/navigation/records.h"

namespace vog {

/// How well the instruments measure, and how far they may be off for good.
struct InstrumentErrors {
  double dvl_sigma_m_s = 0.03;
  double dvl_bias_sigma_m_s = 0.001;
  double dvl_scale_sigma = 0.002;
  double acceleration_noise_m_s_rt_s = 0.3;
  double gyro_noise_rad_rt_s = 3.4e-4;
  double gyro_bias_sigma_rad_s = 1e-5;
  double gyro_bias_walk_rad_s_rt_s = 6.5e-7;
  double attitude_sigma_rad = 0.0035;
  double depth_sigma_m = 0.021;

  void Visit(OptionsVisitor& v) {
    v("dvl_sigma_m_s", dvl_sigma_m_s, Between(1e-4, 10), "of one velocity of the DVL");
    v("dvl_bias_sigma_m_s", dvl_bias_sigma_m_s, Between(0, 1),
      "of what all velocities of a DVL are off by, each axis");
    v("dvl_scale_sigma", dvl_scale_sigma, Between(0, 0.2),
      "of the share that its velocities are too large by: speed of sound, angles of the beams");
    v("acceleration_noise_m_s_rt_s", acceleration_noise_m_s_rt_s, Between(1e-3, 10),
      "how far the vehicle's velocity wanders in a second");
    v("gyro_noise_rad_rt_s", gyro_noise_rad_rt_s, Between(0, 1), "angle random walk of the gyro");
    v("gyro_bias_sigma_rad_s", gyro_bias_sigma_rad_s, Between(0, 1), "bias of the gyro");
    v("gyro_bias_walk_rad_s_rt_s", gyro_bias_walk_rad_s_rt_s, Between(0, 1),
      "how far that bias wanders in a second");
    v("attitude_sigma_rad", attitude_sigma_rad, Between(1e-5, 1), "of one measured roll or pitch");
    v("depth_sigma_m", depth_sigma_m, Between(1e-4, 10), "of one measured depth");
  }
};

/// Error-state Kalman filter [Sola 2017, section 5] over what the instruments measure of the body's
/// own motion: attitude, velocity, height, and the biases of gyro and Doppler log. The horizontal
/// position is not in it, for nothing measures that.
///
/// Observed are roll, pitch and the gyro's biases about those axes (the measured attitude), the
/// height, the Doppler log's vertical bias, and its scale as far as the vehicle dives or climbs
/// (the depth). Heading, the gyro's bias about the vertical and the Doppler log's horizontal biases
/// are not: their variances stay, and the heading's grows with the square of time.
///
/// The velocity in the state is that of the Doppler log with its bias and scale: so its measurement
/// is linear. Were it the vehicle's, each noisy velocity would seem to tell of the scale.
class InstrumentFilter {
 public:
  enum Index : int {
    kRoll = 0,
    kPitch = 1,
    kYaw = 2,
    kGyroBias = 3,  ///< B_ [rad/s], three.
    kVelocity = 6,  ///< B_ [m/s], three: as the DVL would say it, were it not for its noise.
    kHeight = 9,    ///< z of O [m].
    kDvlScale = 10,
    kDvlBias = 11,  ///< B_ [m/s], three.
    kSize = 14,
  };
  using State = Eigen::Matrix<double, kSize, 1>;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  explicit InstrumentFilter(const InstrumentErrors& errors);

  /// Attitude and height at the start; the heading's variance is 0, for it is where O begins.
  void Start(const RollPitchYaw& angles, double z_m);
  /// The motion over `dt_s` at the gyro's rates, Euler angles' kinematics [Fossen 2011, eq. 2.26].
  void Predict(double dt_s, const Vec3& measured_rates_B_rad_s);
  void MeasureAttitude(double roll_rad, double pitch_rad);
  void MeasureVelocity(const Vec3& velocity_B_m_s);
  /// A height farther than `gate_sigmas` from what is expected pulls the height alone, by `gain`:
  /// the biases learn nothing from a jump.
  void MeasureHeight(double z_m, double gate_sigmas, double gain);
  /// Nobody knows the velocity: zero, give or take `sigma_m_s`.
  void ForgetVelocity(double sigma_m_s);

  RollPitchYaw angles() const { return {state_[kRoll], state_[kPitch], state_[kYaw]}; }
  /// Without the DVL's bias and scale.
  Vec3 velocity_B_m_s() const { return VelocityOf(state_); }
  double z_m() const { return state_[kHeight]; }
  /// About the vertical, without the bias [rad/s].
  double YawRate(const Vec3& measured_rates_B_rad_s) const;
  /// Variance of the bias about the vertical [rad2/s2].
  double YawBiasVariance() const;

  const State& state() const { return state_; }
  const Covariance& covariance() const { return covariance_; }

  /// d(state)/dt without noise, of which Predict() takes a step, and its derivative by the state.
  static State Derivative(const State& state, const Vec3& measured_rates_B_rad_s);
  static Covariance Jacobian(const State& state, const Vec3& measured_rates_B_rad_s);
  static Vec3 VelocityOf(const State& state);

 private:
  template <int kRows>
  void Correct(const Eigen::Matrix<double, kRows, 1>& innovation,
               const Eigen::Matrix<double, kRows, kSize>& H, double sigma);

  InstrumentErrors errors_;
  State state_ = State::Zero();
  Covariance covariance_ = Covariance::Zero();
};

}  // namespace vog
