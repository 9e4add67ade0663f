#include "tools/report/run_folder.h"

#include <toml++/toml.h>

#include <algorithm>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/bus/lcm_log.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "lib/planner/mission_options.h"
#include "lib/planner/planner_options.h"
#include "sim/scene/mesh_file.h"

namespace vog {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

[[noreturn]] void NotARun(const fs::path& folder, const std::string& fault) {
  throw UsageError(folder.string() + ": not a finished run: " + fault);
}

Json ReadJson(const fs::path& file) {
  Json json = Json::parse(ReadFile(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) throw UsageError(file.string() + ": damaged: not a JSON object");
  return json;
}

Json ReadJsonIfThere(const fs::path& file) {
  return fs::is_regular_file(file) ? ReadJson(file) : Json();
}

Trajectory ReadTumIfThere(const fs::path& file) {
  return fs::is_regular_file(file) ? ReadTum(file) : Trajectory();
}

/// What the report takes from a log.
class LogScanner {
 public:
  explicit LogScanner(RunFolder& run) : run_(run) {}

  void Add(const LogEvent& event) {
    const auto on = [&](const auto& channel, auto handle) {
      HandleIf(event.channel, event.bytes, channel, handle);
    };
    on(inputs::kRun, [&](const run_t& run) { OnRun(run); });
    on(outputs::kGraph, [&](const graph_t& graph) { OnGraph(graph); });
    on(outputs::kSubmapPoses, [&](const submap_poses_t& poses) { history_.Add(poses); });
    on(outputs::kNav, [&](const nav_t& message) {
      if (const auto sample = FromMessage(message))
        run_.odometry.push_back({sample->time, sample->X_OB});
    });
    on(outputs::kPose, [&](const pose_estimate_t& message) {
      if (const auto X_WB = FromMessage(message.X_WB))
        run_.estimate.push_back({TimeOf(message.header), *X_WB});
    });
    has_truth_ |= event.channel == inputs::kTruth.name;
  }

  /// After the last event.
  void Finish() { run_.closures = history_.Closures(); }

  bool has_run() const { return has_run_; }
  bool has_truth() const { return has_truth_; }

 private:
  void OnRun(const run_t& run) {
    if (has_run_) return;
    run_.program_version = run.program_version;
    run_.mode = run.mode;
    run_.seed = run.seed;
    run_.config_toml = run.config_toml;
    has_run_ = true;
  }

  /// Each GRAPH is whole; the last one counts.
  void OnGraph(const graph_t& graph) {
    history_.Add(graph);
    run_.edges = graph.edge;
    std::erase_if(run_.edges, [](const graph_edge_t& edge) {
      return edge.kind < graph_edge_t::ODOMETRY || edge.kind > graph_edge_t::REJECTED_CLOSURE;
    });
  }

  RunFolder& run_;
  ClosureHistory history_;
  bool has_run_ = false, has_truth_ = false;
};

void ReadLog(const fs::path& folder, RunFolder& run) {
  if (!fs::is_regular_file(folder / "lcm.log")) NotARun(folder, "no lcm.log");
  LogScanner scanner(run);
  LcmLogReader reader((folder / "lcm.log").string());
  while (const auto event = reader.Next()) scanner.Add(*event);
  scanner.Finish();
  if (!scanner.has_run()) NotARun(folder, "lcm.log has no RUN message");
  if (scanner.has_truth() && run.metrics.is_null()) NotARun(folder, "no metrics.json");
}

/// What the pictures need of the settings. Those of another version may not be readable; the
/// report then does without them.
void ReadSettings(RunFolder& run) try {
  const Config config = Config::Parse(run.config_toml, "RUN");
  run.mission_name = config.Read<MissionOptions>("mission").name;
  run.exploration_box_W = config.Read<ExplorationOptions>("exploration").box_W();
  const toml::table settings = toml::parse(run.config_toml);
  if (settings["bus"]["clock"].value<std::string>() == "message")
    run.live_speed = settings["live"]["speed"].value<double>();
} catch (const UsageError&) {
}

/// The judged trajectories, where there are any, replace what was said online.
void ReadTrajectories(const fs::path& folder, RunFolder& run) {
  run.truth = ReadTumIfThere(folder / "truth.tum");
  Trajectory odometry = ReadTumIfThere(folder / "odometry.tum");
  Trajectory estimate = ReadTumIfThere(folder / "estimate.tum");
  if (!odometry.empty()) run.odometry = std::move(odometry);
  if (!estimate.empty()) run.estimate = std::move(estimate);
}

void CheckFolder(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw UsageError(folder.string() + ": no such folder");
}

}  // namespace

int RunFolder::CountEdges(std::int8_t kind) const {
  return static_cast<int>(std::count_if(
      edges.begin(), edges.end(), [&](const graph_edge_t& edge) { return edge.kind == kind; }));
}

std::string RunFolder::Title() const {
  const std::string scene = TextAt(metrics, "/scene");
  return (scene.empty() ? mission_name : scene) + " · mode " + mode + " · seed " +
         std::to_string(seed) + " · " + std::to_string(map.submaps.size()) + " submaps";
}

RunFolder ReadRunFolder(const fs::path& folder) {
  CheckFolder(folder);
  if (!fs::is_regular_file(folder / "timing.json")) NotARun(folder, "no timing.json");
  if (!IsMapFolder(folder / "map")) NotARun(folder, "no map");
  RunFolder run;
  run.timing = ReadJson(folder / "timing.json");
  run.metrics = ReadJsonIfThere(folder / "metrics.json");
  run.series = ReadJsonIfThere(folder / "timeseries.json");
  ReadLog(folder, run);
  ReadSettings(run);
  ReadTrajectories(folder, run);
  run.map = LoadMapFolder(folder / "map").map;
  if (fs::is_regular_file(folder / "scene.ply")) run.scene_W = LoadMesh(folder / "scene.ply", 1);
  return run;
}

RunNumbers ReadRunNumbers(const fs::path& folder) {
  CheckFolder(folder);
  if (!fs::is_regular_file(folder / "metrics.json")) NotARun(folder, "no metrics.json");
  RunNumbers run;
  run.name = folder.lexically_normal().generic_string();
  run.metrics = ReadJson(folder / "metrics.json");
  run.timing = ReadJsonIfThere(folder / "timing.json");
  run.series = ReadJsonIfThere(folder / "timeseries.json");
  return run;
}

std::optional<double> NumberAt(const Json& json, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  if (!json.is_object() || !json.contains(at) || !json.at(at).is_number()) return std::nullopt;
  return json.at(at).get<double>();
}

std::string TextAt(const Json& json, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  if (!json.is_object() || !json.contains(at) || !json.at(at).is_string()) return "";
  return json.at(at).get<std::string>();
}

}  // namespace vog
