#pragma once

#include <memory>
#include <optional>
#include <string>

#include "lib/base/config.h"
#include "lib/bus/stopwatch.h"
#include "lib/messages/endpoint.h"
#include "lib/planner/mission_options.h"
#include "procs/sim/front_seat.h"
#include "procs/sim/sonar_head.h"
#include "sim/world/world.h"

namespace vog {

/// How fast a live simulator goes. Table [live].
struct LiveOptions {
  double speed = 1;
  double max_ahead_s = 0.2;
  double stall_s = 2;

  void Visit(OptionsVisitor& v) {
    v("speed", speed, Between(0.01, 1000), "vehicle time over real time, at most");
    v("max_ahead_s", max_ahead_s, Between(0.01, 10),
      "the simulator waits when the last command is older than this in vehicle time");
    v("stall_s", stall_s, Between(0.1, 600),
      "after so long without a command (real time) the vehicle's time goes on in real time");
  }
};

struct SimSettings {
  WorldSetup world;
  TriangleMesh scene_W;
  MissionOptions mission;
  LiveOptions live;
  VehicleLinkOptions vehicle_link;
  SonarLinkOptions sonar_link;
  PressureOptions pressure;
  std::string config_toml;
  std::int64_t run_id = 0;

  /// @throws UsageError for a missing or empty scene and the like.
  static SimSettings From(const Config& config);
};

/// The wires of a simulated vehicle; each may be none.
struct SimWires {
  std::unique_ptr<FrontSeat> front_seat;
  std::unique_ptr<SonarHead> sonar_head;

  /// @throws UsageError, SystemError.
  static SimWires Open(const SimSettings& settings);
};

/// The simulated vehicle: says what its instruments measure and obeys VEHICLE_COMMAND, or both over
/// wires. In: VEHICLE_COMMAND. Out: RUN, VEHICLE_NAV or DVL, IMU, DEPTH; SONAR_RETURNS or
/// SONAR_FRAME; TRUTH; STATUS.
class SimNode {
 public:
  /// Lock step: the bus's own time moves the world.
  SimNode(Bus& bus, const SimSettings& settings, SimWires wires = {});

  /// Tells all that is due up to `time`.
  void AdvanceTo(Time time);
  /// Takes what came over wires.
  void StepWires();
  /// The next moment at which there is something to tell.
  Time next_due() const { return world_.next_due(); }
  Time time() const { return time_; }
  /// The vehicle time that the newest command answers; the start before the first.
  Time commanded() const { return commanded_; }

 private:
  void OnCommand(const control_t& message);
  /// Now and again: a recorder that has missed one, or comes late, hears the next.
  void PublishRunIfDue();
  void TellNavigation(const Emissions& emissions);
  void TellSonar(const Emissions& emissions);

  SimSettings settings_;
  SimWires wires_;
  Stopwatch since_start_;
  Endpoint endpoint_;
  World world_;
  Time time_;
  Time run_due_;
  Time commanded_;
};

/// Moves a simulator on live: as fast as `live.speed` and the vehicle's commands allow. It runs at
/// most `live.max_ahead_s` ahead of the last command, so that any speed is safe for the processes
/// that answer; when they are gone, time goes on at real time, as it would.
class LivePacer {
 public:
  LivePacer(Bus& bus, SimNode& sim, const LiveOptions& options);

 private:
  void OnTick(Time now);

  SimNode& sim_;
  LiveOptions options_;
  std::optional<Time> anchor_;  // Real time that goes with anchor_sim_.
  Time anchor_sim_;
  Time advanced_;            // When the world last moved, real time.
  bool is_stalled_ = false;  // Nobody answers.
};

}  // namespace vog
