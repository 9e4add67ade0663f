#pragma once

#include "lib/navigation/records.h"
#include "sim/vehicle/vehicle_options.h"

namespace vog {

/// What the thrusters push with, in B: forces along x, y and z [N], and the moment about z [N m].
using Thrust = Eigen::Vector4d;

/// The vehicle's inner loop: holds the body's velocity over ground and its yaw rate. Feed-forward
/// of inertia and drag along a ramp towards the command, and a PI part for the rest (a current).
class VelocityLoop {
 public:
  explicit VelocityLoop(const VehicleOptions& options);

  /// The thrust to ask for, `dt_s` after the last call.
  Thrust Update(double dt_s, const VelocityCommand& command, const Vec3& velocity_B_m_s,
                double yaw_rate_rad_s);

  /// What the thrusters could give of it. While they are at their limit, the integral does not wind
  /// up.
  void Acknowledge(double dt_s, const Thrust& given);

 private:
  Eigen::Vector4d Ramp(double dt_s, const VelocityCommand& command);

  VehicleOptions options_;
  Eigen::Vector4d inertia_, linear_drag_, quadratic_drag_, max_acceleration_;
  Eigen::Vector4d reference_ = Eigen::Vector4d::Zero();  // The ramp's (x, y, z, yaw) velocity.
  Eigen::Vector4d expected_ = Eigen::Vector4d::Zero();   // The same as late as the thrusters.
  Eigen::Vector4d error_ = Eigen::Vector4d::Zero();
  Thrust asked_ = Thrust::Zero();
  Thrust integral_ = Thrust::Zero();
};

}  // namespace vog
