#include "tools/map/map_bench.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "lib/base/errors.h"
#include "lib/base/log.h"
#include "lib/base/parallel.h"
#include "tools/map/bench_check.h"
#include "tools/map/bench_clock.h"
#include "tools/map/bench_method.h"
#include "tools/map/bench_octomap.h"
#include "tools/map/bench_scene.h"
#include "tools/map/bench_workload.h"
#include "tools/mission/progress_bar.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kRepeats = 5;
constexpr double kNanosecond = 1e-9;

/// What does not depend on the method.
struct SharedFigures {
  InsertionFigures insertion;
  double overlap = 0, octomap_search_ns = 0, kb_per_submap = 0, octomap_kb_per_submap = 0;
};

double MeanKb(double bytes, std::size_t count) { return bytes / 1024 / static_cast<double>(count); }

void MeasureStorage(std::span<const BenchSubmap> submaps, SharedFigures& figures) {
  constexpr std::size_t kOctrees = 20;
  double bytes = 0, octomap_bytes = 0;
  for (const BenchSubmap& placed : submaps)
    bytes += static_cast<double>(placed.submap->grid.memory_bytes());
  const auto some = submaps.first(std::min(submaps.size(), kOctrees));
  for (const BenchSubmap& placed : some)
    octomap_bytes += static_cast<double>(OctomapSubmap(placed.submap->grid).memory_bytes());
  figures.kb_per_submap = MeanKb(bytes, submaps.size());
  figures.octomap_kb_per_submap = MeanKb(octomap_bytes, some.size());
}

/// Of the submap in the middle, by size.
const BrickGrid& TypicalGrid(std::span<const BenchSubmap> submaps) {
  std::vector<const BrickGrid*> grids;
  for (const BenchSubmap& placed : submaps) grids.push_back(&placed.submap->grid);
  const auto middle = grids.begin() + static_cast<std::ptrdiff_t>(grids.size() / 2);
  std::nth_element(grids.begin(), middle, grids.end(), [](const BrickGrid* a, const BrickGrid* b) {
    return a->memory_bytes() < b->memory_bytes();
  });
  return **middle;
}

double OctomapSearch_s(const BenchScene& scene, const BrickGrid& grid) {
  constexpr int kSearches = 100'000;
  Random random(scene.seed(), "bench octomap");
  const std::vector<Vec3> places_M = KnownPlaces_M(grid, kSearches, random);
  const OctomapSubmap octree(grid);
  octree.CountKnown(places_M);
  return MedianSeconds(kRepeats, [&] { octree.CountKnown(places_M); }) / kSearches;
}

SharedFigures MeasureShared(const BenchScene& scene, std::span<const BenchSubmap> submaps,
                            const BenchWorkload& workload, const InsertionFigures& insertion) {
  constexpr std::size_t kPlaces = 2000;
  SharedFigures figures;
  figures.insertion = insertion;
  figures.overlap = OverlapAt(submaps, VoxelGrid(scene.voxel_size_m()),
                              std::span(workload.known_voxels).first(kPlaces));
  figures.octomap_search_ns = OctomapSearch_s(scene, TypicalGrid(submaps)) / kNanosecond;
  MeasureStorage(submaps, figures);
  return figures;
}

Json RowOf(const BenchMethod& method, std::size_t submaps, const SharedFigures& shared,
           const MethodFigures& figures) {
  return {{"method", method.name()},
          {"submaps", submaps},
          {"overlap", shared.overlap},
          {"octomap_search_ns", shared.octomap_search_ns},
          {"query_ns", figures.query_ns},
          {"ray_5m_ns", figures.ray_5m_ns},
          {"planning_step_ms", figures.planning_step_ms},
          {"planning_step_after_closure_ms", figures.planning_step_after_closure_ms},
          {"planning_step_after_10_moved_ms", figures.planning_step_after_10_moved_ms},
          {"planning_step_rays", figures.planning_step_rays},
          {"insert_mbeams_s", shared.insertion.mbeams_s},
          {"octomap_insert_mbeams_s", shared.insertion.octomap_mbeams_s},
          {"kb_per_submap", shared.kb_per_submap},
          {"octomap_kb_per_submap", shared.octomap_kb_per_submap},
          {"collision_us", figures.collision_us},
          {"collision_broad_us", figures.collision_broad_us}};
}

std::vector<BenchMethod> ChosenMethods(const std::vector<MapMethod>& chosen) {
  std::vector<BenchMethod> methods = AllBenchMethods();
  std::erase_if(methods, [&](const BenchMethod& method) {
    return !chosen.empty() &&
           std::find(chosen.begin(), chosen.end(), method.method) == chosen.end();
  });
  return methods;
}

/// All measurements of one run, with a bar for those who wait.
class MapBench {
 public:
  explicit MapBench(const BenchOptions& options)
      : options_(options),
        methods_(ChosenMethods(options.methods)),
        scene_(options.scene, options.seed) {}

  Json Run() {
    const int most = *std::max_element(options_.submaps.begin(), options_.submaps.end());
    submaps_ = MakeSubmaps(scene_, most, [&](double share) { Show(share, "submaps"); });
    SetParallelThreads(1);
    const CheckFigures checks = CheckAnswers(scene_, submaps_, options_.checks,
                                             [&](double share) { Show(share, "checks"); });
    constexpr int kInsertedSubmaps = 3;
    Show(0, "adding scans");
    const InsertionFigures insertion = MeasureInsertion(scene_, kInsertedSubmaps, kRepeats);
    Json rows = Json::array();
    for (const int count : options_.submaps) MeasureSize(count, insertion, rows);
    return {{"scene", options_.scene == SceneKind::kTank ? "tank" : "propeller"},
            {"seed", options_.seed},
            {"checks", checks.checks},
            {"differences", checks.differences},
            {"insert_differences", insertion.differences},
            {"rows", rows}};
  }

 private:
  void Show(double share, const std::string& what) { bar_.Show(share, what); }

  void MeasureSize(int count, const InsertionFigures& insertion, Json& rows) {
    const std::span<const BenchSubmap> submaps = std::span(submaps_).first(count);
    const std::string size = std::to_string(count) + " submaps: ";
    Show(0, size + "OctoMap");
    const BenchWorkload workload = MakeWorkload(scene_, submaps);
    const SharedFigures shared = MeasureShared(scene_, submaps, workload, insertion);
    for (std::size_t i = 0; i < methods_.size(); ++i) {
      const BenchMethod& method = methods_[i];
      Show(static_cast<double>(i) / static_cast<double>(methods_.size()), size + method.name());
      if (count > method.most_submaps) continue;
      rows.push_back(
          RowOf(method, submaps.size(), shared, MeasureMethod(method, scene_, submaps, workload)));
    }
  }

  BenchOptions options_;
  std::vector<BenchMethod> methods_;
  BenchScene scene_;
  std::vector<BenchSubmap> submaps_;
  ProgressBar bar_;
};

struct Column {
  const char *key, *title, *unit;
};

constexpr Column kColumns[] = {{"overlap", "overlap", ""},
                               {"octomap_search_ns", "OctoMap", "search ns"},
                               {"query_ns", "query", "ns"},
                               {"ray_5m_ns", "5 m ray", "ns"},
                               {"planning_step_ms", "step", "ms"},
                               {"planning_step_after_closure_ms", "all moved", "ms"},
                               {"planning_step_after_10_moved_ms", "10 moved", "ms"},
                               {"insert_mbeams_s", "insert", "Mbeam/s"},
                               {"octomap_insert_mbeams_s", "OctoMap", "Mbeam/s"},
                               {"kb_per_submap", "submap", "KB"},
                               {"octomap_kb_per_submap", "OctoMap", "KB"},
                               {"collision_us", "collision", "us"},
                               {"collision_broad_us", "its reads", "us"}};

bool IsScaled(const Json& row) { return row["planning_step_rays"] < kStepViews * kViewRays; }

/// Three digits; ~ before times that some rays stand for.
std::string CellOf(const Json& row, const char* key) {
  const double value = row[key];
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", value >= 100 ? 0 : value >= 10 ? 1 : 2, value);
  const bool is_step = std::string_view(key).starts_with("planning_step");
  return (is_step && IsScaled(row) ? "~" : "") + std::string(text);
}

void PrintTable(const Json& report) {
  std::printf("checks %s, differences %s\n", report["checks"].dump().c_str(),
              report["differences"].dump().c_str());
  std::printf("%7s %-17s", "submaps", "method");
  for (const Column& column : kColumns) std::printf(" %9s", column.title);
  std::printf("\n%25s", "");
  for (const Column& column : kColumns) std::printf(" %9s", column.unit);
  std::printf("\n");
  bool is_scaled = false;
  for (const Json& row : report["rows"]) {
    std::printf("%7d %-17s", row["submaps"].get<int>(),
                row["method"].get_ref<const std::string&>().c_str());
    for (const Column& column : kColumns) std::printf(" %9s", CellOf(row, column.key).c_str());
    std::printf("\n");
    is_scaled = is_scaled || IsScaled(row);
  }
  if (is_scaled)
    std::printf("~ scaled to the %d rays of a step from a sample of them\n",
                kStepViews * kViewRays);
}

/// Says on standard error which methods are missing at which sizes.
void TellLeftOut(const BenchOptions& options) {
  for (const int count : options.submaps)
    for (const BenchMethod& method : ChosenMethods(options.methods))
      if (count > method.most_submaps)
        LogLine(method.name() + " is left out with " + std::to_string(count) +
                " submaps: its octrees would fill the memory");
}

}  // namespace

void BenchMaps(const BenchOptions& options) {
  const Json report = MapBench(options).Run();
  TellLeftOut(options);
  if (options.json) {
    std::printf("%s\n", report.dump(2).c_str());
  } else {
    PrintTable(report);
  }
  if (report["differences"] != 0) throw std::runtime_error("cached and direct answers differ");
  if (report["insert_differences"] != 0)
    throw std::runtime_error("submaps and OctoMap's trees of the same scans differ");
}

}  // namespace vog
