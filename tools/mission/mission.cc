#include "tools/mission/mission.h"

#include <algorithm>
#include <array>

#include "lib/base/config_tables.h"
#include "lib/base/files.h"
#include "lib/bus/lcm_bus.h"
#include "lib/bus/lcm_log.h"
#include "lib/bus/stopwatch.h"
#include "procs/controller/controller_node.h"
#include "procs/map_service/map_service_node.h"
#include "procs/nav_bridge/nav_bridge_node.h"
#include "procs/planner/planner_node.h"
#include "procs/sim/sim_node.h"
#include "procs/slam/slam_node.h"
#include "procs/sonar_reader/sonar_reader_node.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/scene_options.h"
#include "tools/mission/evaluate.h"
#include "tools/mission/judge.h"
#include "tools/mission/mesh_mission.h"
#include "tools/mission/simulation_check.h"

namespace vog {
namespace {

// After the mission's end the last submap must be registered and saved within this vehicle time.
constexpr Duration kMaxFinish = std::chrono::seconds(30);

std::int64_t RunIdOf(const Config& config) {
  const std::string text = config.ToToml();
  const std::int64_t id = std::int64_t{Crc32(text)} << 20 ^ Crc32(text + "vogmap");
  return id == 0 ? 1 : id;
}

/// So that the log and the processes of a live run find the mesh from wherever they are.
void MakeMeshAbsolute(Config& config) {
  const std::filesystem::path mesh = config.Read<SceneOptions>("scene").mesh;
  if (mesh.empty() || mesh.is_absolute()) return;
  const std::filesystem::path found = std::filesystem::absolute(config.directory() / mesh);
  config.Set("scene.mesh='" + found.lexically_normal().string() + "'");
}

}  // namespace

void CheckConfig(const Config& config) {
  config.RejectUnknownTables(kConfigTables);
  NavBridgeSettings::From(config);
  SonarReaderSettings::From(config);
  MapServiceSettings::From(config);
  SlamNodeSettings::From(config);
  PlannerSettings::From(config);
  ControllerSettings::From(config);
  config.Read<EvaluationOptions>("evaluation");
  config.Read<LatencyOptions>("latency");
  config.Read<LiveOptions>("live");
}

Config ReadMission(const std::string& file, const MissionOverrides& overrides) {
  Config config = Config::Load(file);
  if (overrides.mode) config.Set("mission.mode='" + *overrides.mode + "'");
  if (overrides.seed) config.Set("mission.seed=" + std::to_string(*overrides.seed));
  if (overrides.max_submaps)
    config.Set("mission.max_submaps=" + std::to_string(*overrides.max_submaps));
  if (overrides.scene) UseMesh(*overrides.scene, config);
  for (const std::string& setting : overrides.settings) config.Set(setting);
  MakeMeshAbsolute(config);
  CheckConfig(config);
  return config;
}

void NumberRun(Config& config) {
  if (config.Read<BusOptions>("bus").run_id == 0)
    config.Set("bus.run_id=" + std::to_string(RunIdOf(config)));
}

void PrepareFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw SystemError(folder.string() + ": cannot create: " + error.message());
  for (const char* name :
       {"map", "lcm.log", "scene.ply", "metrics.json", "timing.json", "timeseries.json",
        "report.html", "mission.toml", "output", kEarlier, "truth.tum", "odometry.tum",
        "estimate.tum", "submap_places.csv", "reconstruction_truth.ply", "reconstruction_vog.ply",
        "reconstruction_vog_no_lc.ply", "reconstruction_standard.ply"})
    std::filesystem::remove_all(folder / name, error);
  // lcm.log.000 and so on, of a mission that had a full disk.
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with("lcm.log."))
      std::filesystem::remove(entry.path(), error);
}

std::string PrepareFolder(const std::filesystem::path& folder,
                          const std::optional<EarlierRun>& earlier) {
  if (earlier) RejectFolderOf(*earlier, folder);
  PrepareFolder(folder);
  if (!earlier) return {};
  KeepEarlierRun(*earlier, folder);
  return (folder / kEarlier / "map").string();
}

double BudgetUsed(const RunProgress& progress, const MissionOptions& mission) {
  const double of_submaps = static_cast<double>(progress.submaps) / mission.max_submaps;
  const double of_time =
      mission.max_duration_s > 0 ? progress.vehicle_time_s / mission.max_duration_s : 0;
  return std::max(of_submaps, of_time);
}

void ShowProgress(const RunProgress& progress, const MissionOptions& mission, double wall_s,
                  ProgressBar& bar) {
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(),
                "%d/%d submaps, %.0f m3 explored, %d closures, %.0f s of vehicle time in %.0f s",
                progress.submaps, mission.max_submaps, progress.explored_m3, progress.closures,
                progress.vehicle_time_s, wall_s);
  bar.Show(BudgetUsed(progress, mission), text.data());
}

void WriteTiming(const RunTiming& timing, const std::filesystem::path& file) {
  nlohmann::ordered_json json;
  json["wall_s"] = timing.wall_s;
  json["node_wall_s"] = timing.node_wall_s;
  json["planning"] = nlohmann::ordered_json::array();
  for (const PlanningTime& planning : timing.planning)
    json["planning"].push_back({{"submaps", planning.submaps}, {"wall_s", planning.wall_s}});
  WriteFileAtomically(file, json.dump(1) + "\n");
}

std::optional<EarlierRun> Resume(const std::optional<std::string>& resume, Config& config) {
  const std::string from = resume.value_or(config.Read<MapOptions>("map").resume);
  if (from.empty()) return std::nullopt;
  EarlierRun earlier = FindEarlierRun(from);
  GoOnFrom(earlier, config);
  return earlier;
}

void FlyMission(const Config& config, const std::filesystem::path& folder,
                const std::optional<EarlierRun>& earlier) {
  const Stopwatch stopwatch;
  const SimSettings sim_settings = CheckedSimSettings(config);
  const MapPlaces places{(folder / "map").string(), PrepareFolder(folder, earlier)};
  RunTiming timing;
  {
    LcmLogWriter log((folder / "lcm.log").string());
    LockStepSystem system(config, places, [&](Time time, const std::string& channel, Bytes bytes) {
      log.Write(time, channel, bytes);
    });
    Bus& sim_bus = system.bus().AddNode("vog-sim");
    SimNode sim(sim_bus, sim_settings);
    SaveMesh(sim_settings.scene_W, folder / "scene.ply");
    sim.AdvanceTo(sim.time());

    ProgressBar bar;
    std::optional<Time> finished;
    while (!system.progress().is_complete) {
      const Time now = sim.next_due();
      system.bus().RunUntil(now);
      sim.AdvanceTo(now);
      const RunProgress& progress = system.progress();
      if (progress.state == "finished" && !finished) finished = now;
      if (finished && now - *finished > kMaxFinish)
        throw SystemError(progress.map_fault.empty() ? "the map was not completed"
                                                     : progress.map_fault);
      ShowProgress(progress, sim_settings.mission, stopwatch.seconds(), bar);
    }
    timing = system.timing();
  }
  timing.wall_s = stopwatch.seconds();
  WriteTiming(timing, folder / "timing.json");
}

nlohmann::ordered_json RunMission(const Config& config, const std::filesystem::path& folder,
                                  const std::optional<EarlierRun>& earlier) {
  FlyMission(config, folder, earlier);
  return JudgeRun(folder);
}

}  // namespace vog
