#pragma once

#include <cstdint>
#include <variant>

#include "lib/base/time.h"
#include "lib/geometry/pose.h"

namespace vog {

/// What the navigation instruments say, already turned to our frames and units.

/// Doppler log: the vehicle's velocity over the bottom.
struct DvlRecord {
  Time time;
  std::int64_t sequence = 0;
  Vec3 velocity_B_m_s = Vec3::Zero();
  bool valid = false;  ///< Bottom lock.
};

/// Attitude and rates.
struct ImuRecord {
  Time time;
  std::int64_t sequence = 0;
  double roll_rad = 0, pitch_rad = 0;
  Vec3 angular_velocity_B_rad_s = Vec3::Zero();
};

/// Pressure sensor.
struct DepthRecord {
  Time time;
  std::int64_t sequence = 0;
  double depth_m = 0;  ///< Below the surface, down positive: -z of the body.
};

/// The pose that the vehicle's own computer dead-reckons.
struct VehicleNavRecord {
  Time time;
  std::int64_t sequence = 0;
  std::int64_t origin = 0;  ///< Of the frame O: the start of the vehicle's reckoning.
  Pose3 X_OB = Pose3::Identity();
  Vec3 velocity_B_m_s = Vec3::Zero();
  double yaw_rate_rad_s = 0;
};

/// Whatever an instrument or the vehicle's computer says.
using NavigationRecord = std::variant<DvlRecord, ImuRecord, DepthRecord, VehicleNavRecord>;

/// Velocities that the vehicle shall hold.
struct VelocityCommand {
  Vec3 velocity_B_m_s = Vec3::Zero();
  double yaw_rate_rad_s = 0;
};

}  // namespace vog
