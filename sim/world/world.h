#pragma once

#include <cstdint>
#include <vector>

#include "lib/geometry/triangle_mesh.h"
#include "lib/navigation/records.h"
#include "lib/scan/sonar_records.h"
#include "sim/scene/ray_caster.h"
#include "sim/sensors/drifted_navigation.h"
#include "sim/sensors/navigation_faults.h"
#include "sim/sensors/navigation_sensors.h"
#include "sim/sensors/sonar_simulator.h"
#include "sim/vehicle/current.h"
#include "sim/vehicle/vehicle.h"
#include "sim/world/world_options.h"

namespace vog {

/// How it really was. For evaluation only.
struct TruthRecord {
  Time time;
  Pose3 X_WB = Pose3::Identity();
  Vec3 velocity_B_m_s = Vec3::Zero();  ///< Over ground.
  Vec3 angular_velocity_B_rad_s = Vec3::Zero();
  Vec3 current_W_m_s = Vec3::Zero();
};

/// What a stretch of time brought, each kind in order of time. Which kinds there are depends on the
/// options: navigation, or one fix at the start and dvl, imu and depth; returns or frames.
struct Emissions {
  std::vector<VehicleNavRecord> navigation;
  std::vector<DvlRecord> dvl;
  std::vector<ImuRecord> imu;
  std::vector<DepthRecord> depth;
  std::vector<SonarReturns> sonar_returns;
  std::vector<SonarFrame> sonar_frames;
  std::vector<TruthRecord> truth;
};

/// The vehicle and its instruments in a scene, over time. A function of the setup, the scene and
/// the commands alone: equal ones give equal bytes. The vehicle does not feel the structure.
class World {
 public:
  /// Starts at simulation.start_time_s. @throws UsageError when the scene has no triangles, when
  /// the vehicle would start inside the structure or touch it, and like the options' Validate().
  World(const WorldSetup& setup, const TriangleMesh& scene);
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Moves on to `now` with the present command, and gives everything due after the last call's
  /// `now` and up to this one; the first call also what is due at the start. @pre times do not
  /// decrease.
  Emissions AdvanceTo(Time now);

  /// Holds from the last AdvanceTo() on, for vehicle.command_timeout_s; without a command the
  /// vehicle holds its place.
  void SetCommand(const VelocityCommand& command) {
    command_ = command;
    command_until_ = time_ + command_timeout_;
  }

  /// The next moment at which something is due.
  Time next_due() const;

 private:
  /// Something that happens every period, from the start on.
  struct Schedule {
    Time start;
    Duration period;
    std::int64_t count = 0;
    Time due() const { return start + count * period; }
  };

  std::vector<const Schedule*> Schedules() const;
  void MoveTo(Time time);
  void Emit(Time now, Emissions& out);
  void EmitInstruments(Time now, const VehicleState& told, Emissions& out);
  void EmitScan(Time now, Emissions& out);
  TruthRecord Truth(Time now) const;

  WorldOptions options_;
  SonarOutput sonar_output_;
  RayCaster scene_;
  SonarSimulator sonar_;
  DriftedNavigation drifted_navigation_;
  NavigationSensors sensors_;
  NavigationFaults faults_;
  Current current_;
  Vehicle vehicle_;
  VelocityCommand command_;
  Duration command_timeout_;
  Time command_until_;
  Time time_;
  Duration physics_step_;
  Schedule scan_schedule_, nav_schedule_, dvl_schedule_, imu_schedule_, depth_schedule_;
  std::int64_t navigation_sequence_ = 0;
};

}  // namespace vog
