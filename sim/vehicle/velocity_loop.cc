#include "sim/vehicle/velocity_loop.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

/// The translations' values and that of yaw.
Eigen::Vector4d WithYaw(const Vec3& translation, const Vec3& rotation) {
  return {translation.x(), translation.y(), translation.z(), rotation.z()};
}

Eigen::Vector4d Limited(const VehicleOptions& options, const VelocityCommand& command) {
  const double speed = command.velocity_B_m_s.norm();
  const double share = speed > options.max_speed_m_s ? options.max_speed_m_s / speed : 1;
  const Vec3 velocity = share * command.velocity_B_m_s;
  return {
      velocity.x(), velocity.y(), velocity.z(),
      std::clamp(command.yaw_rate_rad_s, -options.max_yaw_rate_rad_s, options.max_yaw_rate_rad_s)};
}

}  // namespace

VelocityLoop::VelocityLoop(const VehicleOptions& options)
    : options_(options),
      inertia_(WithYaw(Vec3::Constant(options.mass_kg) + options.added_mass_kg,
                       options.inertia_kg_m2 + options.added_inertia_kg_m2)),
      linear_drag_(WithYaw(options.linear_drag_n_s_m, options.angular_linear_drag_nm_s)),
      quadratic_drag_(
          WithYaw(options.quadratic_drag_n_s2_m2, options.angular_quadratic_drag_nm_s2)),
      max_acceleration_(WithYaw(Vec3::Constant(options.max_acceleration_m_s2),
                                Vec3::Constant(options.max_yaw_acceleration_rad_s2))) {}

Eigen::Vector4d VelocityLoop::Ramp(double dt_s, const VelocityCommand& command) {
  const Eigen::Vector4d step = (Limited(options_, command) - reference_)
                                   .cwiseMin(dt_s * max_acceleration_)
                                   .cwiseMax(-dt_s * max_acceleration_);
  reference_ += step;
  return step / dt_s;
}

Thrust VelocityLoop::Update(double dt_s, const VelocityCommand& command, const Vec3& velocity_B_m_s,
                            double yaw_rate_rad_s) {
  const Eigen::Vector4d acceleration = Ramp(dt_s, command);
  const double lag_s = options_.thruster_lag_s;
  expected_ = reference_ + (lag_s > 0 ? std::exp(-dt_s / lag_s) : 0) * (expected_ - reference_);
  error_ = expected_;
  error_.head<3>() -= velocity_B_m_s;
  error_[3] -= yaw_rate_rad_s;
  const Thrust drag =
      (linear_drag_ + quadratic_drag_.cwiseProduct(reference_.cwiseAbs())).cwiseProduct(reference_);
  asked_ = drag + integral_ +
           inertia_.cwiseProduct(acceleration + options_.proportional_gain_1_s * error_);
  return asked_;
}

void VelocityLoop::Acknowledge(double dt_s, const Thrust& given) {
  for (int i = 0; i < 4; ++i) {
    const bool winds_up = (asked_[i] - given[i]) * error_[i] > 0;
    if (!winds_up) integral_[i] += dt_s * options_.integral_gain_1_s2 * inertia_[i] * error_[i];
  }
}

}  // namespace vog
