#pragma once

#include <array>

#include "lib/navigation/records.h"
#include "sim/vehicle/vehicle_options.h"
#include "sim/vehicle/velocity_loop.h"

namespace vog {

struct VehicleState {
  Pose3 X_WB = Pose3::Identity();
  Vec3 velocity_B_m_s = Vec3::Zero();  ///< Over ground.
  Vec3 angular_velocity_B_rad_s = Vec3::Zero();
};

/// A hovering vehicle in six degrees of freedom [Fossen 2011, 8.1], with its thrusters and its
/// inner loop. Surge, sway, heave and yaw are driven; roll and pitch are only righted by buoyancy.
class Vehicle {
 public:
  /// At rest at `X_WB`.
  Vehicle(const VehicleOptions& options, const Pose3& X_WB);

  /// Moves on by `dt_s` (0.02 s is plenty) in a current that is the same everywhere.
  /// @pre 0 < dt_s <= 0.1.
  void Step(double dt_s, const VelocityCommand& command, const Vec3& current_W_m_s);

  const VehicleState& state() const { return state_; }

  /// For starting from a motion.
  void set_state(const VehicleState& state) { state_ = state; }

  /// Forces of the port and starboard surge, the sway and the fore and aft heave thrusters.
  const std::array<double, 5>& thrusters_n() const { return thrusters_n_; }

 private:
  using StateVector = Eigen::Matrix<double, 13, 1>;  // Position, quaternion, velocity, turn rate.

  Thrust TotalOf(const std::array<double, 5>& thrusters_n) const;
  std::array<double, 5> Allocate(const Thrust& asked) const;
  Thrust MeanThrust(double dt_s, const std::array<double, 5>& asked_n);
  StateVector Derivative(const StateVector& x, const Thrust& thrust,
                         const Vec3& current_W_m_s) const;

  VehicleOptions options_;
  VelocityLoop loop_;
  VehicleState state_;
  std::array<double, 5> thrusters_n_ = {};
};

}  // namespace vog
