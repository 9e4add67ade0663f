#include "tools/plan/plan_bench.h"

#include <algorithm>
#include <memory>
#include <span>

#include "lib/baselines/make_submap_map.h"
#include "lib/bus/stopwatch.h"
#include "lib/planner/view_planner.h"
#include "lib/vogmap/map_folder.h"
#include "procs/planner/planner_node.h"

namespace vog {
namespace {

std::vector<int> SizesOf(const PlanBenchOptions& options, int all) {
  std::vector<int> sizes = options.submaps;
  if (sizes.empty()) sizes = {20, 75, 156, 300, 600, 1000};
  std::erase_if(sizes, [all](int size) { return size > all; });
  if (options.submaps.empty() && (sizes.empty() || sizes.back() != all)) sizes.push_back(all);
  return sizes;
}

struct Step {
  double time_ms = 0;
  bool found_path = false;
};

/// The whole flight: each submap comes, and the planner plans from its base.
std::vector<Step> Fly(PlannerKind kind, const PlannerSettings& settings, const StoredMap& stored,
                      int submaps) {
  const auto map =
      MakeSubmapMap(settings.map.method, stored.voxel_size_m, SensorModel(stored.sensor_model));
  PlannerOptions options = settings.planner;
  options.kind = kind;
  const auto planner = MakeViewPlanner(options, settings.limits, settings.sonar,
                                       settings.exploration.box_W(), settings.mission.seed);
  std::vector<Step> steps;
  for (int i = 0; i < submaps; ++i) {
    const SubmapPtr& submap = stored.submaps[static_cast<std::size_t>(i)];
    const Pose3& X_WM = stored.X_WM.at(submap->id());
    map->Place(submap, X_WM);
    const Waypoint from = WaypointOf(X_WM);
    CollisionChecker checker(settings.planner.collision_rules());
    checker.SetBubble(
        {stored.X_WM.begin()->second.translation(), settings.planner.bubble_radius_m});
    checker.SetPresence(from, stored.voxel_size_m);
    const Stopwatch stopwatch;
    const ViewPlan found = planner->Plan(*map, checker, from);
    steps.push_back({1e3 * stopwatch.seconds(), found.outcome == ViewPlan::Outcome::kGo});
  }
  return steps;
}

/// Of the last steps before the map had more than `submaps`.
PlanBenchRow RowOf(PlannerKind kind, std::span<const Step> steps, int submaps, int plans) {
  const auto last = steps.first(static_cast<std::size_t>(submaps))
                        .last(static_cast<std::size_t>(std::min(plans, submaps)));
  PlanBenchRow row{
      NameOf(PlannerKindNames(), kind), submaps, static_cast<int>(last.size()), 0, 0, 0};
  std::vector<double> times_ms;
  for (const Step& step : last) {
    times_ms.push_back(step.time_ms);
    row.paths += step.found_path;
  }
  std::sort(times_ms.begin(), times_ms.end());
  row.median_ms = times_ms[times_ms.size() / 2];
  row.worst_ms = times_ms.back();
  return row;
}

}  // namespace

std::vector<PlanBenchRow> RunPlanBench(const PlanBenchOptions& options, const Config& config) {
  const StoredMap stored = LoadMapFolder(options.map).map;
  if (stored.submaps.empty()) throw UsageError(options.map + ": the map has no submaps");
  const PlannerSettings settings = PlannerSettings::From(config);
  std::vector<PlanBenchRow> rows;
  const std::vector<int> sizes = SizesOf(options, static_cast<int>(stored.submaps.size()));
  const int most = sizes.empty() ? 0 : *std::max_element(sizes.begin(), sizes.end());
  for (const PlannerKind kind : {PlannerKind::kCoverage, PlannerKind::kNextBestView}) {
    const std::vector<Step> steps = Fly(kind, settings, stored, most);
    for (const int size : sizes) rows.push_back(RowOf(kind, steps, size, options.plans));
  }
  return rows;
}

}  // namespace vog
