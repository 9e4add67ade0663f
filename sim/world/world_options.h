#pragma once

#include <cstdint>

#include "lib/base/config.h"
#include "lib/base/time.h"
#include "lib/geometry/odometry.h"
#include "lib/scan/sonar.h"
#include "sim/sensors/navigation_faults.h"
#include "sim/sensors/navigation_sensors.h"
#include "sim/sensors/sonar_model_options.h"
#include "sim/vehicle/vehicle_options.h"

namespace vog {

/// Where the navigation comes from: a computer that drifts after eq. 8, or instruments whose
/// records the reader's dead reckoning integrates.
enum class NavigationKind { kEq8, kSensors };

/// Table [simulation].
struct WorldOptions {
  double start_time_s = 0;
  Vec3 start_position_m = {0, -3, 0};
  double start_yaw_deg = 90;
  double start_error_x_m = 0;
  double start_error_y_m = 0;
  double start_error_yaw_deg = 0;
  NavigationKind navigation = NavigationKind::kEq8;
  double nav_rate_hz = 10;
  double dvl_rate_hz = 5;
  double imu_rate_hz = 20;
  double depth_rate_hz = 10;
  double physics_step_s = 0.02;

  void Visit(OptionsVisitor& v) {
    v("start_time_s", start_time_s, Between(0, 4e9),
      "when it begins, on from an earlier flight; noise is then another");
    v("start_position_m", start_position_m, Between(-1e5, 1e5), "the vehicle at the start, in W");
    v("start_yaw_deg", start_yaw_deg, Between(-360, 360), "its heading; 90 looks along +y");
    v("start_error_x_m", start_error_x_m, Between(-1e5, 1e5),
      "how far the vehicle's own reckoning is off at the start, in W");
    v("start_error_y_m", start_error_y_m, Between(-1e5, 1e5), "and in y");
    v("start_error_yaw_deg", start_error_yaw_deg, Between(-360, 360), "and in heading");
    v("navigation", navigation,
      Names<NavigationKind>{{NavigationKind::kEq8, "eq8"}, {NavigationKind::kSensors, "sensors"}},
      "the vehicle says a pose that drifts after eq. 8, or what its instruments measure");
    v("nav_rate_hz", nav_rate_hz, Between(0.1, 1000), "poses a second (and one at each scan)");
    v("dvl_rate_hz", dvl_rate_hz, Between(0.1, 1000), "velocity fixes a second");
    v("imu_rate_hz", imu_rate_hz, Between(0.1, 1000), "attitudes and turn rates a second");
    v("depth_rate_hz", depth_rate_hz, Between(0.1, 1000), "depths a second");
    v("physics_step_s", physics_step_s, Between(1e-3, 0.1), "longest step of the vehicle's motion");
  }

  Time start() const { return Time(FromSeconds(start_time_s)); }
  Pose3 StartPose() const;  ///< X_WB.
  Vec3 StartError() const;  ///< Of the reckoning, in (x, y, yaw).
};

/// All that a simulated world is made of but its scene. The tables: [simulation], [vehicle],
/// [current], [sonar], [sonar_model], [drift], [navigation_sensors], [navigation_faults].
struct WorldSetup {
  WorldOptions simulation;
  VehicleOptions vehicle;
  CurrentOptions current;
  SonarOptions sonar;
  SonarModelOptions sonar_model;
  DriftOptions drift;
  SensorOptions navigation_sensors;
  NavigationFaultOptions navigation_faults;
  std::uint64_t seed = 1;  ///< Of all noise. Equal seeds give equal runs.
};

/// The seed of a flight's noise: the mission's and, so that a flight that goes on from another one
/// does not repeat its noise, of when it begins.
std::uint64_t NoiseSeed(std::uint64_t mission_seed, Time start);

}  // namespace vog
