#pragma once

#include <cstdint>

#include "lib/navigation/records.h"
#include "sim/vehicle/vehicle.h"

namespace vog {

/// Table [navigation_sensors]: what Doppler log, inertial unit and pressure sensor are like.
struct SensorOptions {
  Vec3 dvl_sigma_m_s = {0.0266, 0.0266, 0.02};
  double dvl_bias_sigma_m_s = 0.001;
  double dvl_scale_sigma = 0.002;
  double dvl_dropout_share = 0.087;
  double dvl_dropout_goes_on = 0.3;
  int dvl_dropout_max = 2;
  double gyro_noise_density_rad_s_sqrt_hz = 3.4e-4;
  double gyro_bias_sigma_rad_s = 1e-5;
  double gyro_bias_walk_rad_s_sqrt_h = 3.9e-5;
  double attitude_sigma_deg = 0.2;
  double depth_sigma_m = 0.021;

  void Visit(OptionsVisitor& v) {
    v("dvl_sigma_m_s", dvl_sigma_m_s, Between(0, 10), "noise of the velocities along x, y and z");
    v("dvl_bias_sigma_m_s", dvl_bias_sigma_m_s, Between(0, 1),
      "of what all velocities are off by, each axis");
    v("dvl_scale_sigma", dvl_scale_sigma, Between(0, 0.2),
      "of the share that all velocities are too large by");
    v("dvl_dropout_share", dvl_dropout_share, Between(0, 0.9),
      "share of fixes without bottom lock");
    v("dvl_dropout_goes_on", dvl_dropout_goes_on, Between(0, 1),
      "probability that a dropout takes the next fix too");
    v("dvl_dropout_max", dvl_dropout_max, Between(1, 10000), "longest dropout, in fixes");
    v("gyro_noise_density_rad_s_sqrt_hz", gyro_noise_density_rad_s_sqrt_hz, Between(0, 1),
      "white noise of the turn rates");
    v("gyro_bias_sigma_rad_s", gyro_bias_sigma_rad_s, Between(0, 1),
      "bias of the rates at the start");
    v("gyro_bias_walk_rad_s_sqrt_h", gyro_bias_walk_rad_s_sqrt_h, Between(0, 1),
      "how far the bias wanders in an hour");
    v("attitude_sigma_deg", attitude_sigma_deg, Between(0, 30), "noise of roll and pitch");
    v("depth_sigma_m", depth_sigma_m, Between(0, 10), "noise of the depth");
  }
};

/// The instruments of a vehicle that does its own dead reckoning. Each has a stream of noise of its
/// own, "dvl", "imu" and "depth", and its sequence number for the step.
class NavigationSensors {
 public:
  NavigationSensors(const SensorOptions& options, Duration imu_period, std::uint64_t seed);

  /// @pre called once for each sequence number, in order (the dropouts go on from fix to fix).
  DvlRecord Dvl(Time time, std::int64_t sequence, const VehicleState& truth);

  /// @pre called once for each sequence number, in order (the bias wanders).
  ImuRecord Imu(Time time, std::int64_t sequence, const VehicleState& truth);

  DepthRecord Depth(Time time, std::int64_t sequence, const VehicleState& truth) const;

 private:
  double DropoutStarts() const;

  SensorOptions options_;
  double imu_period_s_;
  std::uint64_t seed_;
  double dropout_starts_;  // Probability, after a valid fix.
  int fixes_lost_in_a_row_ = 0;
  Vec3 gyro_bias_B_rad_s_;
  Vec3 dvl_bias_B_m_s_;
  double dvl_scale_;  // 1 and what velocities are too large by.
};

}  // namespace vog
