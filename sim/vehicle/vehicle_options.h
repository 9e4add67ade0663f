#pragma once

#include "lib/base/config.h"
#include "lib/geometry/pose.h"

namespace vog {

/// Table [vehicle]: a hovering vehicle with five thrusters, in Fossen's form. Vectors are along (or
/// about) the axes of B: x forward, y left, z up; B's origin is the centre of gravity. Defaults:
/// dimensions and thrust of the HAUV, hydrodynamics scaled from the public RexROV and BlueROV2
/// sets.
struct VehicleOptions {
  Vec3 hull_size_m = {1, 1, 0.5};
  double mass_kg = 72.6;
  Vec3 inertia_kg_m2 = {6.1, 11.6, 15.9};
  Vec3 added_mass_kg = {33, 43, 115};
  Vec3 added_inertia_kg_m2 = {5, 10, 7};
  Vec3 linear_drag_n_s_m = {20, 25, 70};
  Vec3 quadratic_drag_n_s2_m2 = {163, 233, 634};
  Vec3 angular_linear_drag_nm_s = {15, 20, 12};
  Vec3 angular_quadratic_drag_nm_s2 = {15, 30, 20};
  double metacentric_height_m = 0.025;
  double munk_share = 0.25;
  double thruster_limit_n = 55;
  double thruster_lag_s = 0.15;
  double surge_thruster_offset_m = 0.3;
  double command_timeout_s = 1;
  double max_speed_m_s = 0.5;
  double max_yaw_rate_rad_s = 0.5;
  double max_acceleration_m_s2 = 0.2;
  double max_yaw_acceleration_rad_s2 = 0.3;
  double proportional_gain_1_s = 1.5;
  double integral_gain_1_s2 = 1;

  void Visit(OptionsVisitor& v) {
    v("hull_size_m", hull_size_m, Between(0.01, 50),
      "length, breadth and height of the hull's box");
    v("mass_kg", mass_kg, Between(0.1, 1e6), "mass; the vehicle is neutrally buoyant");
    v("inertia_kg_m2", inertia_kg_m2, Between(1e-4, 1e7), "moments of inertia");
    v("added_mass_kg", added_mass_kg, Between(0, 1e6), "added mass, along each axis");
    v("added_inertia_kg_m2", added_inertia_kg_m2, Between(0, 1e7), "added inertia");
    v("linear_drag_n_s_m", linear_drag_n_s_m, Between(0, 1e6), "drag in proportion to speed");
    v("quadratic_drag_n_s2_m2", quadratic_drag_n_s2_m2, Between(0, 1e6),
      "drag in proportion to the speed's square");
    v("angular_linear_drag_nm_s", angular_linear_drag_nm_s, Between(0, 1e6),
      "damping in proportion to the turn rate");
    v("angular_quadratic_drag_nm_s2", angular_quadratic_drag_nm_s2, Between(0, 1e6),
      "damping in proportion to the turn rate's square");
    v("metacentric_height_m", metacentric_height_m, Between(0, 1),
      "height of the centre of buoyancy above that of gravity; it rights roll and pitch");
    v("munk_share", munk_share, Between(0, 1),
      "share of the ideal flow's turning moment that real, separated flow leaves");
    v("thruster_limit_n", thruster_limit_n, Between(0, 1e5), "greatest force of a thruster");
    v("thruster_lag_s", thruster_lag_s, Between(0, 5), "time constant of the thrusters");
    v("surge_thruster_offset_m", surge_thruster_offset_m, Between(0.01, 10),
      "of the two surge thrusters to the left and right; their difference yaws");
    v("command_timeout_s", command_timeout_s, Between(0.05, 60),
      "the vehicle's own watchdog: without a command for so long it stops");
    v("max_speed_m_s", max_speed_m_s, Between(0, 20), "faster commands are cut to this");
    v("max_yaw_rate_rad_s", max_yaw_rate_rad_s, Between(0, 10), "faster commands are cut to this");
    v("max_acceleration_m_s2", max_acceleration_m_s2, Between(0.001, 100),
      "how fast the inner loop lets each velocity rise, from rest and to rest");
    v("max_yaw_acceleration_rad_s2", max_yaw_acceleration_rad_s2, Between(0.001, 100),
      "the same for the yaw rate");
    v("proportional_gain_1_s", proportional_gain_1_s, Between(0, 50),
      "of the inner loop: acceleration for an error in velocity");
    v("integral_gain_1_s2", integral_gain_1_s2, Between(0, 50),
      "of the inner loop: takes up currents and wrong feed-forward");
  }
};

/// Table [current]: a horizontal current that wanders around its mean (a Gauss-Markov process).
struct CurrentOptions {
  Vec3 mean_m_s = Vec3::Zero();
  double sigma_m_s = 0;
  double time_constant_s = 60;

  void Visit(OptionsVisitor& v) {
    v("mean_m_s", mean_m_s, Between(-5, 5), "mean current in W");
    v("sigma_m_s", sigma_m_s, Between(0, 5), "standard deviation along x and along y");
    v("time_constant_s", time_constant_s, Between(0.1, 1e6),
      "how long the current remembers itself");
  }
};

}  // namespace vog
