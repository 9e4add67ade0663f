#include "sim/world/world.h"

#include <algorithm>
#include <string>

#include "lib/base/files.h"
#include "sim/scene/overlap.h"

namespace vog {
namespace {

Duration PeriodOf(double rate_hz) { return FromSeconds(1 / rate_hz); }

const TriangleMesh& NotEmpty(const TriangleMesh& scene) {
  if (scene.triangles.empty()) throw UsageError("the scene has no triangles");
  return scene;
}

std::string Describe(const Vec3& p) {
  return "(" + ToText(p.x()) + ", " + ToText(p.y()) + ", " + ToText(p.z()) + ")";
}

}  // namespace

World::World(const WorldSetup& setup, const TriangleMesh& scene)
    : options_(setup.simulation),
      sonar_output_(setup.sonar_model.emits),
      scene_(NotEmpty(scene)),
      sonar_(setup.sonar, setup.sonar_model, scene_, setup.seed),
      drifted_navigation_(setup.drift, setup.sonar.period(), setup.seed, options_.StartError()),
      sensors_(setup.navigation_sensors, PeriodOf(options_.imu_rate_hz), setup.seed),
      faults_(setup.navigation_faults),
      current_(setup.current, options_.physics_step_s, setup.seed),
      vehicle_(setup.vehicle, options_.StartPose()),
      command_timeout_(FromSeconds(setup.vehicle.command_timeout_s)),
      command_until_(options_.start()),
      time_(options_.start()),
      physics_step_(FromSeconds(options_.physics_step_s)),
      scan_schedule_{time_, setup.sonar.period()},
      nav_schedule_{time_, PeriodOf(options_.nav_rate_hz)},
      dvl_schedule_{time_, PeriodOf(options_.dvl_rate_hz)},
      imu_schedule_{time_, PeriodOf(options_.imu_rate_hz)},
      depth_schedule_{time_, PeriodOf(options_.depth_rate_hz)} {
  const Pose3 X_WB = options_.StartPose();
  if (scene_.Inside(X_WB.translation()) || BoxTouches(scene, X_WB, setup.vehicle.hull_size_m)) {
    throw UsageError("the vehicle would start inside an obstacle at " +
                     Describe(options_.start_position_m) + ": set simulation.start_position_m");
  }
}

std::vector<const World::Schedule*> World::Schedules() const {
  std::vector<const Schedule*> schedules = {&scan_schedule_, &nav_schedule_};
  if (options_.navigation == NavigationKind::kSensors)
    schedules.insert(schedules.end(), {&dvl_schedule_, &imu_schedule_, &depth_schedule_});
  return schedules;
}

Time World::next_due() const {
  Time next = Time::max();
  for (const Schedule* schedule : Schedules()) next = std::min(next, schedule->due());
  return next;
}

Emissions World::AdvanceTo(Time now) {
  Emissions out;
  for (Time due = next_due(); due <= now; due = next_due()) {
    MoveTo(due);
    Emit(due, out);
  }
  MoveTo(now);
  return out;
}

/// In steps that end at multiples of the physics step, whatever is due in between.
void World::MoveTo(Time time) {
  while (time_ < time) {
    const Time grid = Time((time_.time_since_epoch() / physics_step_ + 1) * physics_step_);
    const Time end = std::min(time, grid);
    const VelocityCommand command = end <= command_until_ ? command_ : VelocityCommand{};
    vehicle_.Step(ToSeconds(end - time_), command, current_.velocity_W_m_s());
    if (end == grid) current_.Step();
    time_ = end;
  }
}

void World::Emit(Time now, Emissions& out) {
  const VehicleState told = faults_.Apply(now, vehicle_.state());
  const bool nav_due = nav_schedule_.due() == now, scan_due = scan_schedule_.due() == now;
  if (nav_due || scan_due) {
    out.truth.push_back(Truth(now));
    // With instruments alone, a first fix tells where the vehicle starts.
    if (options_.navigation == NavigationKind::kEq8 || now == options_.start()) {
      out.navigation.push_back(drifted_navigation_.Sample(now, navigation_sequence_++, told));
    }
  }
  if (options_.navigation == NavigationKind::kSensors) EmitInstruments(now, told, out);
  if (scan_due) EmitScan(now, out);
  if (nav_due) ++nav_schedule_.count;
}

void World::EmitInstruments(Time now, const VehicleState& told, Emissions& out) {
  if (dvl_schedule_.due() == now) {
    DvlRecord record = sensors_.Dvl(now, dvl_schedule_.count++, told);
    if (faults_.HasLostLock(now)) record = {.time = record.time, .sequence = record.sequence};
    out.dvl.push_back(record);
  }
  if (imu_schedule_.due() == now) out.imu.push_back(sensors_.Imu(now, imu_schedule_.count++, told));
  if (depth_schedule_.due() == now)
    out.depth.push_back(sensors_.Depth(now, depth_schedule_.count++, told));
}

void World::EmitScan(Time now, Emissions& out) {
  const std::int64_t sequence = scan_schedule_.count++;
  const Pose3& X_WB = vehicle_.state().X_WB;
  if (sonar_output_ == SonarOutput::kReturns) {
    out.sonar_returns.push_back(sonar_.Returns(now, sequence, X_WB));
  } else {
    out.sonar_frames.push_back(sonar_.Frame(now, sequence, X_WB));
  }
}

TruthRecord World::Truth(Time now) const {
  const VehicleState& state = vehicle_.state();
  return {now, state.X_WB, state.velocity_B_m_s, state.angular_velocity_B_rad_s,
          current_.velocity_W_m_s()};
}

}  // namespace vog
