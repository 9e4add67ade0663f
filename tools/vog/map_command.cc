#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "lib/base/log.h"
#include "lib/baselines/make_submap_map.h"
#include "lib/bus/process.h"
#include "lib/occupancy/ray_answers.h"
#include "procs/map_service/map_server_node.h"
#include "tools/map/map_bench.h"
#include "tools/map/map_export.h"
#include "tools/map/map_import.h"
#include "tools/map/map_merge.h"
#include "tools/mission/replay.h"
#include "tools/vog/commands.h"
#include "tools/vog/config_arguments.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

/// Loads a map folder; what is damaged in it is told on standard error.
StoredMap Load(const std::string& folder) {
  LoadedMap loaded = LoadMapFolder(folder);
  for (const std::string& fault : loaded.faults) LogLine(fault);
  return std::move(loaded.map);
}

std::unique_ptr<SubmapMap> MakeMap(const StoredMap& stored, MapMethod method) {
  auto map = MakeSubmapMap(method, stored.voxel_size_m, SensorModel(stored.sensor_model));
  for (const SubmapPtr& submap : stored.submaps) map->Place(submap, stored.X_WM.at(submap->id()));
  return map;
}

/// Only remembered answers are those of voxels; the other maps are asked at the places themselves.
bool AnswersVoxels(MapMethod method) { return method == MapMethod::kCached; }

std::map<std::string, MapMethod> MethodsByName() {
  std::map<std::string, MapMethod> methods;
  for (const auto& [value, name] : MapMethodNames()) methods[name] = value;
  return methods;
}

void AddMethod(CLI::App& command, MapMethod& method) {
  command
      .add_option("--method", method,
                  "cached: eq. 5 at the centres of voxels; at the places themselves: direct (eq. "
                  "5), algorithm1 (clamps each addition), incremental_merge (one global grid)")
      ->transform(CLI::CheckedTransformer(MethodsByName()).description(""))
      ->type_name("METHOD")
      ->default_str(NameOf(MapMethodNames(), method));
}

const char* NameOf(VoxelState state) {
  switch (state) {
    case VoxelState::kFree:
      return "free";
    case VoxelState::kOccupied:
      return "occupied";
    case VoxelState::kUnknown:
      break;
  }
  return "unknown";
}

Json LogOddsJson(float log_odds) { return IsKnown(log_odds) ? Json(log_odds) : Json(nullptr); }

Json VectorJson(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

void RejectExisting(const std::string& folder) {
  if (IsMapFolder(folder))
    throw UsageError(folder + ": there is a map already; choose another folder");
}

/// Makes a map that a command has written fast to open, and says what it is.
void FinishMap(const std::string& folder) {
  const LoadedMap loaded = LoadMapFolder(folder);
  for (const std::string& fault : loaded.faults) LogLine(fault);
  if (loaded.compact != CompactState::kValid) PackMapFolder(folder);
  std::printf("%zu submaps in %s\n", loaded.map.submaps.size(), folder.c_str());
}

// --- build ---

struct BuildArguments {
  std::string source, out, config;
  std::string free_space = "none";
  ImportOptions options;
};

void Build(const BuildArguments& arguments) {
  ImportOptions options = arguments.options;
  options.free_space = arguments.free_space == "rays" ? FreeSpace::kRays : FreeSpace::kNone;
  const std::filesystem::path source = arguments.source;
  if (!std::filesystem::exists(source))
    throw UsageError(source.string() + ": no such file or folder");
  RejectExisting(arguments.out);
  if (std::filesystem::is_directory(source)) {
    SaveMapFolder(ImportClouds(source, options), arguments.out);
  } else if (source.extension() == ".graph") {
    SaveMapFolder(ImportScanGraph(source, options), arguments.out);
  } else if (source.extension() == ".ot" || source.extension() == ".bt") {
    SaveMapFolder(ImportOctree(source, options), arguments.out);
  } else {
    BuildMapFromLog(source,
                    arguments.config.empty() ? ConfigOfLog(source) : Config::Load(arguments.config),
                    arguments.out);
  }
  FinishMap(arguments.out);
}

void AddBuild(CLI::App& map) {
  auto* command = map.add_subcommand(
      "build",
      "Make a map from recorded data: a folder of .pcd clouds with poses in VIEWPOINT (a "
      "submap each), an OctoMap .graph scan log, an OctoMap octree (.ot, .bt), or an LCM log.");
  const auto arguments = std::make_shared<BuildArguments>();
  ImportOptions& options = arguments->options;
  command->add_option("source", arguments->source, "folder, .graph, .ot, .bt or LCM log")
      ->required();
  command->add_option("--out", arguments->out, "the map's folder")->required();
  command->add_option("--voxel-size", options.submap.voxel_size_m, "side of a voxel [m]")
      ->check(CLI::Range(0.005, 5.0))
      ->capture_default_str();
  command
      ->add_option("--scans-per-submap", options.submap.scans_per_submap,
                   "scans of a .graph that make a submap")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command
      ->add_option("--free-space", arguments->free_space,
                   "none, or rays: clouds also free the way from their viewpoint")
      ->check(CLI::IsMember({"none", "rays"}))
      ->capture_default_str();
  command->add_option("--config", arguments->config,
                      "mission file for an LCM log that has no RUN message");
  command->add_flag("--z-down", options.z_down, "clouds and their poses have z down");
  command->callback([arguments] { Build(*arguments); });
}

// --- merge, pack ---

void AddMerge(CLI::App& map) {
  struct Arguments {
    std::vector<std::string> maps;
    std::string out;
  };
  auto* command = map.add_subcommand(
      "merge",
      "Put maps into one: their submaps renumbered, at the poses they have, with no edge between "
      "the maps.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("maps", arguments->maps, "map folders")->required();
  command->add_option("--out", arguments->out, "the new map's folder")->required();
  command->callback([arguments] {
    RejectExisting(arguments->out);
    SaveMapFolder(MergeMaps({arguments->maps.begin(), arguments->maps.end()}), arguments->out);
    FinishMap(arguments->out);
  });
}

void AddPack(CLI::App& map) {
  auto* command = map.add_subcommand(
      "pack", "Make a map's compact.bin anew from its octrees, so that it opens fast.");
  const auto folder = std::make_shared<std::string>();
  command->add_option("map", *folder, "map folder")->required();
  command->callback([folder] { PackMapFolder(*folder); });
}

// --- serve ---

struct ServeArguments {
  std::string map;
  ConfigArguments config;
};

void Serve(const ServeArguments& arguments) {
  const auto options = arguments.config.Load().Read<BusOptions>("bus");
  const std::atomic<bool>& stop = StopSignal();
  LcmBus bus(options);
  MapServerNode node(bus, ToVogMap(Load(arguments.map)), options.run_id);
  std::printf("serving %s until Ctrl-C\n", arguments.map.c_str());
  std::fflush(stdout);
  bus.Run(stop);
}

void AddServe(CLI::App& map) {
  auto* command = map.add_subcommand(
      "serve",
      "Answer MAP_REQUEST (points, ray, box, snapshot) over LCM for a saved map, which stays as "
      "it is, until Ctrl-C.");
  const auto arguments = std::make_shared<ServeArguments>();
  command->add_option("map", arguments->map, "map folder")->required();
  command->add_option("--config", arguments->config.file, "mission file whose table [bus] to use");
  command->add_option("--set", arguments->config.settings, "bus.key=value, on top of the file");
  command->callback([arguments] { Serve(*arguments); });
}

// --- info ---

const char* NameOf(CompactState state) {
  switch (state) {
    case CompactState::kMissing:
      return "missing";
    case CompactState::kStale:
      return "stale";
    case CompactState::kDamaged:
      return "damaged";
    case CompactState::kValid:
      break;
  }
  return "valid";
}

std::uintmax_t BytesOnDisk(const std::string& folder) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

/// Where the vehicle was when the mission ended.
Json EndJson(const StoredMap& stored) {
  if (!stored.end || stored.submaps.empty()) return nullptr;
  const Pose3 X_WE = stored.X_WM.at(stored.submaps.back()->id()) * stored.end->X_ME;
  return VectorJson(X_WE.translation());
}

struct InfoArguments {
  std::string map;
  bool json = false;
};

void ShowInfo(const InfoArguments& arguments) {
  const LoadedMap loaded = LoadMapFolder(arguments.map);
  const StoredMap& stored = loaded.map;
  const VogMap map = ToVogMap(stored);
  std::int64_t known = 0, occupied = 0, bytes = 0, scans = 0;
  for (const SubmapPtr& submap : stored.submaps) {
    submap->grid.ForEach([&](const VoxelKey&, LogOddsUnits units) {
      ++known;
      occupied += map.IsOccupied(ToLogOdds(units));
    });
    bytes += static_cast<std::int64_t>(submap->grid.memory_bytes());
    scans += submap->scans;
  }
  const Eigen::AlignedBox3d bounds_W = map.Bounds();
  const auto per_submap = [&](std::int64_t total) {
    return stored.submaps.empty()
               ? 0.0
               : static_cast<double>(total) / static_cast<double>(stored.submaps.size());
  };
  Json json = {{"submaps", stored.submaps.size()},
               {"scans", scans},
               {"complete", stored.complete},
               {"first_of_flight", stored.put_in ? stored.put_in->id : 0},
               {"end_W_m", EndJson(stored)},
               {"voxel_size_m", stored.voxel_size_m},
               {"known_voxels", known},
               {"occupied_voxels", occupied},
               {"kb_per_submap", per_submap(bytes) / 1024},
               {"bytes_on_disk", BytesOnDisk(arguments.map)},
               {"compact_file", NameOf(loaded.compact)},
               {"min_W_m", bounds_W.isEmpty() ? Json(nullptr) : VectorJson(bounds_W.min())},
               {"max_W_m", bounds_W.isEmpty() ? Json(nullptr) : VectorJson(bounds_W.max())},
               {"faults", loaded.faults}};
  if (arguments.json) {
    std::printf("%s\n", json.dump(2).c_str());
    return;
  }
  for (const auto& [key, value] : json.items())
    std::printf("%-16s %s\n", key.c_str(), value.dump().c_str());
}

void AddInfo(CLI::App& map) {
  auto* command = map.add_subcommand("info", "What a map holds.");
  const auto arguments = std::make_shared<InfoArguments>();
  command->add_option("map", arguments->map, "map folder")->required();
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { ShowInfo(*arguments); });
}

// --- query ---

struct QueryArguments {
  std::string map, points = "-";
  MapMethod method = MapMethod::kCached;
  bool json = false;
};

std::vector<Vec3> ReadPoints(std::istream& in, const std::string& name) {
  std::vector<Vec3> points;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream values(line);
    Vec3 p;
    if (!(values >> p.x() >> p.y() >> p.z()) || !p.allFinite())
      throw UsageError(name + ":" + std::to_string(number) + ": not three numbers x y z");
    points.push_back(p);
  }
  return points;
}

std::vector<Vec3> ReadPoints(const std::string& file) {
  if (file == "-") return ReadPoints(std::cin, "standard input");
  std::ifstream in(file);
  if (!in) throw UsageError(file + ": no such file");
  return ReadPoints(in, file);
}

void PrintPlaces(const OccupancyMap& map, const std::vector<Vec3>& points_W,
                 const std::vector<float>& log_odds, bool json) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    const char* state = NameOf(map.StateOf(log_odds[i]));
    const Vec3& p = points_W[i];
    if (json) {
      rows.push_back({{"x", p.x()},
                      {"y", p.y()},
                      {"z", p.z()},
                      {"state", state},
                      {"log_odds", LogOddsJson(log_odds[i])}});
    } else if (IsKnown(log_odds[i])) {
      std::printf("%.6g %.6g %.6g %s %g\n", p.x(), p.y(), p.z(), state, log_odds[i]);
    } else {
      std::printf("%.6g %.6g %.6g %s nan\n", p.x(), p.y(), p.z(), state);
    }
  }
  if (json) std::printf("%s\n", rows.dump(1).c_str());
}

void Query(const QueryArguments& arguments) {
  const auto map = MakeMap(Load(arguments.map), arguments.method);
  std::vector<Vec3> points_W = ReadPoints(arguments.points);
  std::vector<float> log_odds(points_W.size());
  if (AnswersVoxels(arguments.method)) {
    std::vector<VoxelKey> voxels;
    for (Vec3& p : points_W) {
      voxels.push_back(map->grid().KeyOf(p));
      p = map->grid().CenterOf(voxels.back());
    }
    map->LogOddsOf(voxels, log_odds);
  } else {
    map->LogOddsAt(points_W, log_odds);
  }
  PrintPlaces(*map, points_W, log_odds, arguments.json);
}

void AddQuery(CLI::App& map) {
  auto* command = map.add_subcommand(
      "query",
      "Ask for places: a line `x y z state logodds` each, state free, occupied or unknown.");
  const auto arguments = std::make_shared<QueryArguments>();
  command->add_option("map", arguments->map, "map folder")->required();
  command
      ->add_option("--points", arguments->points, "file with lines x y z, or - for standard input")
      ->capture_default_str();
  AddMethod(*command, arguments->method);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Query(*arguments); });
}

// --- raycast ---

struct RaycastArguments {
  std::string map;
  MapMethod method = MapMethod::kCached;
  std::vector<double> origin, direction;
  double range_m = 10;
  bool json = false;
};

void Raycast(const RaycastArguments& arguments) {
  const Vec3 origin_W = Eigen::Map<const Vec3>(arguments.origin.data());
  const Vec3 direction = Eigen::Map<const Vec3>(arguments.direction.data());
  if (!(direction.norm() > 1e-9)) throw UsageError("--direction must not be zero");
  const Vec3 direction_W = direction.normalized();
  const auto map = MakeMap(Load(arguments.map), arguments.method);
  const auto ask = AnswersVoxels(arguments.method) ? AnswersInVoxels : AnswersAtSteps;
  const RayAnswers answer = ask(*map, origin_W, direction_W, arguments.range_m);
  const bool is_hit = !answer.log_odds.empty() && map->IsOccupied(answer.log_odds.back());
  const double hit_m = is_hit ? (answer.points_W.back() - origin_W).norm() : 0;
  if (!arguments.json) {
    PrintPlaces(*map, answer.points_W, answer.log_odds, false);
    if (is_hit) {
      std::printf("# hit after %.4g m\n", hit_m);
    } else {
      std::printf("# no hit within %.4g m\n", arguments.range_m);
    }
    return;
  }
  Json json = {{"hit", is_hit}, {"range_m", is_hit ? Json(hit_m) : Json(nullptr)}};
  for (std::size_t i = 0; i < answer.points_W.size(); ++i)
    json["ray"].push_back({{"p_W_m", VectorJson(answer.points_W[i])},
                           {"state", NameOf(map->StateOf(answer.log_odds[i]))},
                           {"log_odds", LogOddsJson(answer.log_odds[i])}});
  std::printf("%s\n", json.dump(1).c_str());
}

void AddRaycast(CLI::App& map) {
  auto* command = map.add_subcommand("raycast", "Follow a ray to the first occupied place.");
  const auto arguments = std::make_shared<RaycastArguments>();
  command->add_option("map", arguments->map, "map folder")->required();
  command->add_option("--origin", arguments->origin, "X Y Z [m]")->expected(3)->required();
  command->add_option("--direction", arguments->direction, "X Y Z, of any length")
      ->expected(3)
      ->required();
  command->add_option("--range", arguments->range_m, "how far [m]")
      ->check(CLI::Range(0.0, 1e4))
      ->required();
  AddMethod(*command, arguments->method);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Raycast(*arguments); });
}

// --- export ---

void AddExport(CLI::App& map) {
  struct Arguments {
    std::string map, out;
  };
  auto* command = map.add_subcommand(
      "export", "Write the merged map: .ot, .bt (OctoMap), .ply, .pcd (occupied), .vtk (known).");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("map", arguments->map, "map folder")->required();
  command->add_option("out", arguments->out, "file")->required();
  command->callback([arguments] { ExportMap(ToVogMap(Load(arguments->map)), arguments->out); });
}

// --- bench ---

void AddBench(CLI::App& map) {
  auto* command = map.add_subcommand(
      "bench",
      "Measure this map beside other ways to answer, on submaps that it makes from a seed.\n"
      "\n"
      "Each submap holds 100 sonar scans of a short way through the free water of a scene. First\n"
      "answers are compared bit for bit with eq. 5 over a random history of the map; then one\n"
      "thread measures, and the median of some repeats is told:\n"
      "  overlap     submaps that know a place, on the average\n"
      "  search      OctoMap finds a voxel in one submap's octree: the yardstick\n"
      "  query       a random known voxel, of many asked for together\n"
      "  ray         5 m, or up to the first occupied voxel, one by one\n"
      "  step        15 views of 96 rays of 5 m, as the planner counts unknown voxels\n"
      "  all moved   moving all submaps a little, and the step after it\n"
      "  10 moved    the same for 10 of them\n"
      "  insert      million beams a second that become a submap, here and in OctoMap\n"
      "  KB          of a submap in memory, here and as OctoMap's octree\n"
      "  collision   the vehicle's box against the map at a random pose; its reads alone\n"
      "~ marks times of a step that are scaled from a sample of its rays. Differences end the\n"
      "program with status 1.");
  const auto options = std::make_shared<BenchOptions>();
  command->add_option("--submaps", options->submaps, "sizes of the map, N,N,...")
      ->delimiter(',')
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_option("--scene", options->scene, "tank or propeller")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, SceneKind>{{"tank", SceneKind::kTank},
                                                       {"propeller", SceneKind::kPropeller}})
                      .description(""))
      ->type_name("SCENE")
      ->default_str("tank");
  command->add_option("--seed", options->seed, "of ways, noise and questions")
      ->capture_default_str();
  command
      ->add_option("--methods", options->methods,
                   "cached, direct, algorithm1, incremental_merge; all by default")
      ->delimiter(',')
      ->transform(CLI::CheckedTransformer(MethodsByName()).description(""))
      ->type_name("METHOD,...");
  command->add_option("--checks", options->checks, "answers to compare before measuring")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 40))
      ->capture_default_str();
  command->add_flag("--json", options->json, "print JSON");
  command->callback([options] { BenchMaps(*options); });
}

}  // namespace

void AddMapCommand(CLI::App& app) {
  auto* map = app.add_subcommand("map", "Build maps from recorded data, and ask them.");
  map->require_subcommand(1);
  AddBuild(*map);
  AddMerge(*map);
  AddPack(*map);
  AddServe(*map);
  AddInfo(*map);
  AddQuery(*map);
  AddRaycast(*map);
  AddExport(*map);
  AddBench(*map);
}

}  // namespace vog
