#include "tools/mission/replay.h"

#include <regex>

#include "lib/bus/lcm_log.h"
#include "lib/bus/stopwatch.h"
#include "lib/messages/endpoint.h"
#include "lib/planner/mission_options.h"
#include "lib/vogmap/map_folder.h"
#include "lib/vogmap/map_options.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/scene.h"
#include "tools/mission/judge.h"
#include "tools/mission/mission.h"
#include "tools/mission/progress_bar.h"
#include "tools/report/report.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

constexpr Duration kMaxFinish = std::chrono::seconds(30);

/// Says that the mission is over, for a log that breaks off before.
void SayFinished(QueueBus& bus, std::int64_t run_id) {
  Endpoint endpoint(bus.AddNode("vog-replay"), "vog-replay", run_id);
  mission_status_t status{};
  status.state = "finished";
  status.end_reason = "end_of_log";
  endpoint.Publish(outputs::kMissionStatus, status, bus.now());
}

/// The channels to feed: what the vehicle said or, in a log without that, what was made of it.
std::regex ChannelsToFeed(const std::filesystem::path& log) {
  const std::regex navigation("VEHICLE_NAV|IMU");
  LcmLogReader reader(log.string());
  while (const auto event = reader.Next()) {
    if (std::regex_match(event->channel, navigation)) return std::regex(kInputsRegex);
  }
  return std::regex("RUN|NAV|SCAN|TRUTH");
}

/// Feeds a log and brings the map to its end.
void Feed(const std::filesystem::path& log, const Config& config, LockStepSystem& system) {
  const Stopwatch stopwatch;
  ProgressBar bar;
  QueueBus& bus = system.bus();
  const auto mission = config.Read<MissionOptions>("mission");
  const std::regex channels = ChannelsToFeed(log);
  LcmLogReader reader(log.string());
  bool has_fed = false;
  while (const auto event = reader.Next()) {
    if (!std::regex_match(event->channel, channels)) continue;
    // As in a mission: what was due by then comes first, and what the vehicle said at one moment is
    // there before anybody answers.
    if (event->time > bus.now()) {
      bus.RunUntil(event->time);
      ShowProgress(system.progress(), mission, stopwatch.seconds(), bar);
    }
    bus.PublishAt(bus.now(), event->channel, event->bytes);
    has_fed = true;
  }
  if (!has_fed) throw UsageError(log.string() + ": holds nothing to build a map from");
  bus.RunUntil(bus.now());
  if (system.progress().is_complete) return;
  if (system.progress().state != "finished") SayFinished(bus, system.progress().run_id);
  bus.RunUntil(bus.now() + kMaxFinish);
  if (system.progress().is_complete) return;
  throw SystemError(system.progress().map_fault.empty() ? log.string() + ": gives no map"
                                                        : system.progress().map_fault);
}

/// The map that the run of a log went on from, by map.resume: where that is relative, beside the
/// log. Empty when it went on from none.
fs::path ResumedMap(const fs::path& log, const Config& config) {
  const std::string resume = config.Read<MapOptions>("map").resume;
  return resume.empty() ? fs::path() : log.parent_path() / resume;
}

std::optional<EarlierRun> EarlierRunOf(const fs::path& log, const Config& config,
                                       const std::optional<std::string>& resume) {
  const fs::path map = ResumedMap(log, config);
  if (map.empty()) {
    if (resume) throw UsageError(log.string() + ": its run did not go on from another one");
    return std::nullopt;
  }
  if (resume) return FindEarlierRun(*resume);
  if (!IsMapFolder(map))
    throw UsageError(log.string() + ": its run went on from a map that is not in " + map.string() +
                     "; tell with --resume where it is");
  return FindEarlierRun(map);
}

}  // namespace

std::optional<run_t> FirstRun(const std::filesystem::path& log, int max_events) {
  LcmLogReader reader(log.string());
  for (int i = 0; i < max_events; ++i) {
    const auto event = reader.Next();
    if (!event) break;
    run_t run{};
    if (event->channel == inputs::kRun.name && Decode(event->bytes, run)) return run;
  }
  return std::nullopt;
}

Config ConfigOfLog(const std::filesystem::path& log) {
  const auto run = FirstRun(log);
  if (!run) throw UsageError(log.string() + ": no RUN message; not the log of a run");
  return Config::Parse(run->config_toml, log.string() + " (RUN)");
}

void ReplayLog(const std::filesystem::path& log, const std::filesystem::path& folder,
               const std::optional<std::string>& resume) {
  const Config config = ConfigOfLog(log);
  CheckConfig(config);
  const MapPlaces places{(folder / "map").string(),
                         PrepareFolder(folder, EarlierRunOf(log, config, resume))};
  const Stopwatch stopwatch;
  RunTiming timing;
  bool has_truth = false;
  {
    LcmLogWriter out((folder / "lcm.log").string());
    LockStepSystem system(config, places, [&](Time time, const std::string& channel, Bytes bytes) {
      has_truth |= channel == inputs::kTruth.name;
      out.Write(time, channel, bytes);
    });
    Feed(log, config, system);
    timing = system.timing();
  }
  timing.wall_s = stopwatch.seconds();
  WriteTiming(timing, folder / "timing.json");
  if (!has_truth) {  // A vehicle's log: nothing to judge by.
    WriteReport(folder);
    return;
  }
  SaveMesh(MakeScene(SceneSettings::From(config)), folder / "scene.ply");
  JudgeRun(folder);
}

void BuildMapFromLog(const std::filesystem::path& log, const Config& config,
                     const std::filesystem::path& map_folder) {
  CheckConfig(config);
  const MapPlaces places{map_folder.string(), ResumedMap(log, config).string()};
  LockStepSystem system(config, places, [](Time, const std::string&, Bytes) {});
  Feed(log, config, system);
}

}  // namespace vog
