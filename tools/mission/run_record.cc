#include "tools/mission/run_record.h"

#include <algorithm>
#include <iterator>

#include "lib/bus/lcm_log.h"
#include "lib/messages/endpoint.h"
#include "lib/scan/scan_synchronizer.h"
#include "tools/mission/resume.h"

namespace vog {
namespace {

/// Builds a RunRecord from a log's events.
class Recorder {
 public:
  void Add(const LogEvent& event) {
    const auto on = [&](const auto& channel, auto handle) {
      HandleIf(event.channel, event.bytes, channel, handle);
    };
    on(inputs::kRun, [&](const run_t& run) { OnRun(run); });
    on(inputs::kTruth, [&](const truth_t& message) {
      if (const auto X_WB = FromMessage(message.X_WB))
        record_.truth.push_back({TimeOf(message.header), *X_WB});
    });
    on(outputs::kNav, [&](const nav_t& message) {
      if (const auto sample = FromMessage(message)) synchronizer_.Add(*sample);
    });
    on(outputs::kScan, [&](const scan_t& message) {
      if (auto scan = FromMessage(message)) synchronizer_.Add(std::move(*scan));
    });
    on(outputs::kSubmapPoses, [&](const submap_poses_t& message) {
      if (auto places = FromMessage(message)) record_.places = std::move(*places);
    });
    on(outputs::kGraph, [&](const graph_t& graph) { OnGraph(graph); });
    on(outputs::kMissionStatus, [&](const mission_status_t& status) { OnStatus(status); });
    while (auto registered = synchronizer_.Next())
      record_.scans.push_back({std::move(registered->scan), registered->odometry});
  }

  RunRecord Finish(const std::filesystem::path& log) {
    if (!has_run_) throw UsageError(log.string() + ": no RUN message; not a log of a run");
    if (record_.truth.empty())
      throw UsageError(log.string() + ": no TRUTH messages; only simulated runs can be evaluated");
    PlaceScans();
    record_.begins = {record_.truth.front().time};
    return std::move(record_);
  }

 private:
  void OnRun(const run_t& run) {
    if (has_run_) return;
    record_.config = Config::Parse(run.config_toml, "the log's configuration");
    record_.mode = run.mode;
    record_.seed = run.seed;
    record_.run_id = run.header.run_id;
    has_run_ = true;
  }

  void OnGraph(const graph_t& graph) {
    const auto count = [&](std::int8_t kind) {
      return static_cast<int>(std::count_if(graph.edge.begin(), graph.edge.end(),
                                            [&](const auto& edge) { return edge.kind == kind; }));
    };
    record_.full_closures = count(graph_edge_t::FULL_CLOSURE);
    record_.partial_closures = count(graph_edge_t::PARTIAL_CLOSURE);
    record_.rejected_closures = count(graph_edge_t::REJECTED_CLOSURE);
  }

  void OnStatus(const mission_status_t& status) {
    if (status.state != "finished" || !record_.end_reason.empty()) return;
    record_.end_reason = status.end_reason;
    record_.is_home = status.is_home != 0;
    record_.unseen_voxels = status.unseen_voxels;
    record_.unseen_in_vain = status.unseen_in_vain;
    record_.end_time_s = ToSeconds(TimeOf(status.header));
  }

  /// Scans without truth, at the very end of a log, are left out.
  void PlaceScans() {
    std::vector<RunScan> placed;
    for (RunScan& scan : record_.scans) {
      const auto truth =
          std::lower_bound(record_.truth.begin(), record_.truth.end(), scan.scan.time,
                           [](const TimedPose& pose, Time time) { return pose.time < time; });
      if (truth == record_.truth.end() || truth->time != scan.scan.time) continue;
      scan.X_WB_true = truth->X_WB;
      placed.push_back(std::move(scan));
    }
    record_.scans = std::move(placed);
  }

  RunRecord record_;
  ScanSynchronizer synchronizer_;
  bool has_run_ = false;
};

}  // namespace

RunRecord ReadRun(const std::filesystem::path& log) {
  LcmLogReader reader(log.string());
  Recorder recorder;
  while (const auto event = reader.Next()) recorder.Add(*event);
  return recorder.Finish(log);
}

RunRecord ReadFlights(const std::filesystem::path& folder) {
  RunRecord record = ReadRun(folder / "lcm.log");
  if (!std::filesystem::is_regular_file(folder / kEarlier / "lcm.log")) return record;
  RunRecord earlier = ReadFlights(folder / kEarlier);
  const auto prepend = [](auto& before, auto& all) {
    before.insert(before.end(), std::make_move_iterator(all.begin()),
                  std::make_move_iterator(all.end()));
    all = std::move(before);
  };
  prepend(earlier.scans, record.scans);
  prepend(earlier.truth, record.truth);
  prepend(earlier.begins, record.begins);
  return record;
}

}  // namespace vog
