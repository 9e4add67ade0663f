#include "sim/vehicle/vehicle.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr double kGravity_m_s2 = 9.81;

enum Thruster { kPortSurge, kStarboardSurge, kSway, kForeHeave, kAftHeave };

Vec3 Drag(const Vec3& linear, const Vec3& quadratic, const Vec3& v) {
  return (linear + quadratic.cwiseProduct(v.cwiseAbs())).cwiseProduct(v);
}

Eigen::Matrix<double, 13, 1> Pack(const VehicleState& state) {
  Eigen::Matrix<double, 13, 1> x;
  x << state.X_WB.translation(), Eigen::Quaterniond(state.X_WB.linear()).coeffs(),
      state.velocity_B_m_s, state.angular_velocity_B_rad_s;
  return x;
}

Eigen::Quaterniond OrientationOf(const Eigen::Matrix<double, 13, 1>& x) {
  return Eigen::Quaterniond(x[6], x[3], x[4], x[5]);
}

VehicleState Unpack(const Eigen::Matrix<double, 13, 1>& x) {
  return {MakePose(x.head<3>(), OrientationOf(x)), x.segment<3>(7), x.tail<3>()};
}

}  // namespace

Vehicle::Vehicle(const VehicleOptions& options, const Pose3& X_WB)
    : options_(options), loop_(options) {
  state_.X_WB = X_WB;
}

Thrust Vehicle::TotalOf(const std::array<double, 5>& thrusters_n) const {
  return {
      thrusters_n[kPortSurge] + thrusters_n[kStarboardSurge], thrusters_n[kSway],
      thrusters_n[kForeHeave] + thrusters_n[kAftHeave],
      options_.surge_thruster_offset_m * (thrusters_n[kStarboardSurge] - thrusters_n[kPortSurge])};
}

std::array<double, 5> Vehicle::Allocate(const Thrust& asked) const {
  const double yaw = asked[3] / options_.surge_thruster_offset_m;
  std::array<double, 5> thrusters_n;
  thrusters_n[kPortSurge] = 0.5 * (asked[0] - yaw);
  thrusters_n[kStarboardSurge] = 0.5 * (asked[0] + yaw);
  thrusters_n[kSway] = asked[1];
  thrusters_n[kForeHeave] = thrusters_n[kAftHeave] = 0.5 * asked[2];
  for (double& thrust_n : thrusters_n)
    thrust_n = std::clamp(thrust_n, -options_.thruster_limit_n, options_.thruster_limit_n);
  return thrusters_n;
}

/// Runs the thrusters' lag, exactly, and gives their mean over the step.
Thrust Vehicle::MeanThrust(double dt_s, const std::array<double, 5>& asked_n) {
  const double lag_s = options_.thruster_lag_s;
  const double kept = lag_s > 0 ? std::exp(-dt_s / lag_s) : 0;
  std::array<double, 5> mean_n;
  for (std::size_t i = 0; i < mean_n.size(); ++i) {
    const double missing_n = thrusters_n_[i] - asked_n[i];
    mean_n[i] = asked_n[i] + missing_n * (1 - kept) * lag_s / dt_s;
    thrusters_n_[i] = asked_n[i] + missing_n * kept;
  }
  return TotalOf(mean_n);
}

Vehicle::StateVector Vehicle::Derivative(const StateVector& x, const Thrust& thrust,
                                         const Vec3& current_W_m_s) const {
  const Eigen::Quaterniond q_WB = OrientationOf(x).normalized();
  const Vec3 v = x.segment<3>(7), w = x.tail<3>();
  const Vec3 current_B = q_WB.conjugate() * current_W_m_s;
  const Vec3 through_water = v - current_B;
  const Vec3 added_momentum = options_.added_mass_kg.cwiseProduct(through_water);
  const Vec3 mass = Vec3::Constant(options_.mass_kg) + options_.added_mass_kg;
  const Vec3 inertia = options_.inertia_kg_m2 + options_.added_inertia_kg_m2;
  // The water that moves along feels the body's acceleration against a current at rest in W.
  const Vec3 force =
      thrust.head<3>() - options_.mass_kg * w.cross(v) - w.cross(added_momentum) -
      options_.added_mass_kg.cwiseProduct(w.cross(current_B)) -
      Drag(options_.linear_drag_n_s_m, options_.quadratic_drag_n_s2_m2, through_water);
  const Vec3 up_B = q_WB.conjugate() * Vec3::UnitZ();
  const Vec3 righting =
      options_.mass_kg * kGravity_m_s2 * options_.metacentric_height_m * Vec3::UnitZ().cross(up_B);
  const Vec3 moment =
      Vec3(0, 0, thrust[3]) + righting - w.cross(inertia.cwiseProduct(w)) -
      options_.munk_share * through_water.cross(added_momentum) -
      Drag(options_.angular_linear_drag_nm_s, options_.angular_quadratic_drag_nm_s2, w);
  StateVector derivative;
  derivative << q_WB * v, 0.5 * (q_WB * Eigen::Quaterniond(0, w.x(), w.y(), w.z())).coeffs(),
      force.cwiseQuotient(mass), moment.cwiseQuotient(inertia);
  return derivative;
}

void Vehicle::Step(double dt_s, const VelocityCommand& command, const Vec3& current_W_m_s) {
  const Thrust asked =
      loop_.Update(dt_s, command, state_.velocity_B_m_s, state_.angular_velocity_B_rad_s.z());
  const std::array<double, 5> asked_n = Allocate(asked);
  loop_.Acknowledge(dt_s, TotalOf(asked_n));
  const Thrust thrust = MeanThrust(dt_s, asked_n);
  // Runge and Kutta's classical rule.
  const StateVector x = Pack(state_);
  const StateVector k1 = Derivative(x, thrust, current_W_m_s);
  const StateVector k2 = Derivative(x + 0.5 * dt_s * k1, thrust, current_W_m_s);
  const StateVector k3 = Derivative(x + 0.5 * dt_s * k2, thrust, current_W_m_s);
  const StateVector k4 = Derivative(x + dt_s * k3, thrust, current_W_m_s);
  state_ = Unpack(x + dt_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
}

}  // namespace vog
