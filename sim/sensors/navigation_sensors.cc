#include "sim/sensors/navigation_sensors.h"

#include <cmath>

#include "lib/base/random.h"

namespace vog {
namespace {

constexpr double kHour_s = 3600;

}  // namespace

NavigationSensors::NavigationSensors(const SensorOptions& options, Duration imu_period,
                                     std::uint64_t seed)
    : options_(options),
      imu_period_s_(ToSeconds(imu_period)),
      seed_(seed),
      dropout_starts_(DropoutStarts()),
      gyro_bias_B_rad_s_(
          Random(seed, "gyro_bias").GaussianVector(Vec3::Constant(options.gyro_bias_sigma_rad_s))) {
  Random random(seed, "dvl_bias");
  dvl_bias_B_m_s_ = random.GaussianVector(Vec3::Constant(options.dvl_bias_sigma_m_s));
  dvl_scale_ = 1 + random.Gaussian(options.dvl_scale_sigma);
}

/// Of valid runs of mean length 1 / p and dropouts of mean length L, the share L / (L + 1 / p) is
/// lost.
double NavigationSensors::DropoutStarts() const {
  double mean_length = 0, reaches = 1;
  for (int length = 1; length <= options_.dvl_dropout_max; ++length) {
    mean_length += reaches;
    reaches *= options_.dvl_dropout_goes_on;
  }
  const double share = options_.dvl_dropout_share;
  return share / (mean_length * (1 - share));
}

DvlRecord NavigationSensors::Dvl(Time time, std::int64_t sequence, const VehicleState& truth) {
  Random random(seed_, "dvl", sequence);
  const Vec3 velocity_B_m_s = dvl_scale_ * truth.velocity_B_m_s + dvl_bias_B_m_s_ +
                              random.GaussianVector(options_.dvl_sigma_m_s);
  const bool may_be_lost = fixes_lost_in_a_row_ < options_.dvl_dropout_max;
  const double probability =
      fixes_lost_in_a_row_ > 0 ? options_.dvl_dropout_goes_on : dropout_starts_;
  const bool lost = may_be_lost && random.Chance(probability);
  fixes_lost_in_a_row_ = lost ? fixes_lost_in_a_row_ + 1 : 0;
  return {.time = time,
          .sequence = sequence,
          .velocity_B_m_s = lost ? Vec3::Zero() : velocity_B_m_s,
          .valid = !lost};
}

ImuRecord NavigationSensors::Imu(Time time, std::int64_t sequence, const VehicleState& truth) {
  Random random(seed_, "imu", sequence);
  const RollPitchYaw angles = AnglesOf(truth.X_WB);
  const double attitude_sigma = options_.attitude_sigma_deg * EIGEN_PI / 180;
  ImuRecord record{.time = time, .sequence = sequence};
  record.roll_rad = angles.roll + random.Gaussian(attitude_sigma);
  record.pitch_rad = angles.pitch + random.Gaussian(attitude_sigma);
  const double noise = options_.gyro_noise_density_rad_s_sqrt_hz / std::sqrt(imu_period_s_);
  record.angular_velocity_B_rad_s = truth.angular_velocity_B_rad_s + gyro_bias_B_rad_s_ +
                                    random.GaussianVector(Vec3::Constant(noise));
  const double walk = options_.gyro_bias_walk_rad_s_sqrt_h * std::sqrt(imu_period_s_ / kHour_s);
  gyro_bias_B_rad_s_ += random.GaussianVector(Vec3::Constant(walk));
  return record;
}

DepthRecord NavigationSensors::Depth(Time time, std::int64_t sequence,
                                     const VehicleState& truth) const {
  const double noise_m = Random(seed_, "depth", sequence).Gaussian(options_.depth_sigma_m);
  return {.time = time, .sequence = sequence, .depth_m = noise_m - truth.X_WB.translation().z()};
}

}  // namespace vog
