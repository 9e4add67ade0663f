#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/bus/queue_bus.h"
#include "lib/messages/channels.h"

namespace vog {

/// What a run tells while it goes on.
struct RunProgress {
  double vehicle_time_s = 0;  ///< Since the first message.
  int submaps = 0;
  int closures = 0;
  double explored_m3 = 0;
  std::string state;
  std::string end_reason;
  std::string map_fault;
  std::int64_t run_id = 0;   ///< That the map service found in its messages.
  bool is_complete = false;  ///< The mission is over and the map saved.
};

/// Keeps a RunProgress up to date from messages.
class ProgressWatcher {
 public:
  void OnMessage(Time time, const std::string& channel, Bytes bytes);
  const RunProgress& progress() const { return progress_; }

 private:
  RunProgress progress_;
  std::optional<Time> begin_;
};

/// How long planning took, and how many submaps there were.
struct PlanningTime {
  int submaps = 0;
  double wall_s = 0;
};

/// Wall times of a run; never part of a result.
struct RunTiming {
  double wall_s = 0;
  std::map<std::string, double> node_wall_s;
  std::vector<PlanningTime> planning;
};

/// Where a run keeps its map, and the map of earlier flights that it goes on from, if any:
/// map.directory and map.resume.
struct MapPlaces {
  std::string directory, resume;
};

/// All nodes but the vehicle on one bus in one thread, in simulated time.
class LockStepSystem {
 public:
  /// Begins when the simulated vehicle does. Every message is passed to `observer` as well.
  LockStepSystem(const Config& config, const MapPlaces& places, QueueBus::Observer observer);
  ~LockStepSystem();

  /// The bus, for the vehicle's node or a log's events.
  QueueBus& bus() { return bus_; }

  const RunProgress& progress() const { return watcher_.progress(); }
  const RunTiming& timing() const { return timing_; }

 private:
  struct Nodes;

  void OnHandled(const QueueBus::Handled& handled);

  QueueBus bus_;
  ProgressWatcher watcher_;
  RunTiming timing_;
  std::unique_ptr<Nodes> nodes_;
};

/// Modelled time that each node's work takes, in lock step. Table [latency].
struct LatencyOptions {
  double nav_bridge_s = 0, sonar_reader_s = 0, map_service_s = 0, slam_s = 0, planner_s = 0,
         controller_s = 0;

  void Visit(OptionsVisitor& v);
};

}  // namespace vog
