#include "tools/mission/live.h"

#include <unistd.h>

#include <algorithm>
#include <set>

#include "lib/base/files.h"
#include "lib/bus/lcm_bus.h"
#include "lib/bus/process.h"
#include "lib/bus/stopwatch.h"
#include "lib/messages/endpoint.h"
#include "procs/sim/sim_node.h"
#include "sim/scene/mesh_file.h"
#include "tools/log/log_recorder.h"
#include "tools/mission/judge.h"
#include "tools/mission/mission.h"
#include "tools/mission/process_group.h"
#include "tools/mission/progress_bar.h"
#include "tools/mission/simulation_check.h"

namespace vog {
namespace {

constexpr Duration kTendPeriod = std::chrono::milliseconds(100);
constexpr Duration kFlushPeriod = std::chrono::seconds(1);
constexpr double kMaxStart_s = 30;
// Real time that the last submap may take to be registered and saved.
constexpr double kMaxFinish_s = 60;

const std::vector<std::string> kPrograms = {"vog-nav-bridge", "vog-sonar-reader", "vog-map-service",
                                            "vog-slam",       "vog-planner",      "vog-controller"};

/// Writes all messages to a log and remembers what they say of the run.
class Recorder {
 public:
  /// What is said before the vehicle's time begins, at `start`, is written as if said then.
  Recorder(LcmBus& bus, const std::filesystem::path& log, Time start) : log_({log}) {
    bus.SubscribeAll([this, start](Time time, const std::string& channel, Bytes bytes) {
      log_.Write(std::max(time, start), channel, bytes);
      watcher_.OnMessage(time, channel, bytes);
      HandleIf(channel, bytes, outputs::kStatus,
               [&](const status_t& status) { heard_.insert(status.process); });
    });
    bus.Every(kFlushPeriod, [this](Time) { log_.Tick(); });
  }

  const RunProgress& progress() const { return watcher_.progress(); }
  /// Hands all to the system; returns the number of messages that the disk had no room for.
  std::int64_t Finish() {
    log_.Tick();
    return log_.lost();
  }
  bool HasHeardAll() const {
    return std::all_of(kPrograms.begin(), kPrograms.end(),
                       [this](const std::string& name) { return heard_.count(name) > 0; });
  }

 private:
  LogRecorder log_;
  ProgressWatcher watcher_;
  std::set<std::string> heard_;
};

void WaitUntilReady(LcmBus& bus, ProcessGroup& processes, const Recorder& recorder,
                    const std::atomic<bool>& stop) {
  const Stopwatch waited;
  while (!recorder.HasHeardAll()) {
    if (stop) throw SystemError("stopped");
    if (waited.seconds() > kMaxStart_s) throw SystemError("the processes do not get ready");
    bus.RunFor(kTendPeriod);
    processes.Tend();
  }
}

void WaitUntilComplete(LcmBus& bus, ProcessGroup& processes, const Recorder& recorder,
                       const MissionOptions& mission, const std::atomic<bool>& stop) {
  const Stopwatch stopwatch;
  ProgressBar bar;
  std::optional<Stopwatch> finished;
  const RunProgress& progress = recorder.progress();
  // A lost MISSION_STATUS is said again; the log needs the one that tells the end's reason.
  while (!progress.is_complete || progress.state != "finished") {
    if (stop) throw SystemError("stopped");
    bus.RunFor(kTendPeriod);
    processes.Tend();
    ShowProgress(progress, mission, stopwatch.seconds(), bar);
    if (!finished && (progress.is_complete || progress.state == "finished")) finished.emplace();
    if (finished && finished->seconds() > kMaxFinish_s)
      throw SystemError(!progress.map_fault.empty() ? progress.map_fault
                        : progress.is_complete      ? "the planner does not tell how it ended"
                                                    : "the map was not completed");
  }
}

}  // namespace

nlohmann::ordered_json RunLiveMission(const Config& config, const std::filesystem::path& folder,
                                      double speed, const std::optional<EarlierRun>& earlier) {
  const Stopwatch stopwatch;
  const std::atomic<bool>& stop = StopSignal();
  const SimSettings sim = CheckedSimSettings(config);
  const std::string resume = PrepareFolder(folder, earlier);
  SaveMesh(sim.scene_W, folder / "scene.ply");
  const std::string config_file = (folder / "mission.toml").string();
  WriteFileAtomically(config_file, config.ToToml());
  const std::vector<std::string> arguments = {
      "--config", config_file,
      "--set",    "bus.clock=message",
      "--set",    "map.directory='" + (folder / "map").string() + "'",
      "--set",    "map.resume='" + resume + "'",
      "--set",    "live.speed=" + ToText(speed)};
  std::int64_t lost = 0;
  {
    BusOptions bus_options = config.Read<BusOptions>("bus");
    bus_options.clock = ClockSource::kMessage;
    LcmBus bus(bus_options);
    Recorder recorder(bus, folder / "lcm.log", sim.world.simulation.start());
    ProcessGroup processes(ProgramFolder(), folder / "output");
    for (const std::string& name : kPrograms) processes.Start({name, arguments, true});
    WaitUntilReady(bus, processes, recorder, stop);
    processes.Start({"vog-sim", arguments, false});
    WaitUntilComplete(bus, processes, recorder, sim.mission, stop);
    lost = recorder.Finish();
  }
  // The judge believes the log: of one with gaps it would tell what never was.
  if (lost > 0)
    throw SystemError((folder / "lcm.log").string() +
                      ": the disk was full: " + std::to_string(lost) +
                      " messages are missing, so the mission is not judged; its map is whole");
  RunTiming timing;
  timing.wall_s = stopwatch.seconds();
  WriteTiming(timing, folder / "timing.json");
  return JudgeRun(folder);
}

}  // namespace vog
