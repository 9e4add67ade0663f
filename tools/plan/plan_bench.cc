#include "tools/plan/plan_bench.h"

#include <algorithm>
#include <memory>

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

PlanBenchRow Measure(PlannerKind kind, const PlannerSettings& settings, const StoredMap& stored,
                     int submaps, int plans) {
  const auto map =
      MakeSubmapMap(settings.map.method, stored.voxel_size_m, SensorModel(stored.sensor_model));
  for (int i = 0; i < submaps; ++i) {
    const SubmapPtr& submap = stored.submaps[static_cast<std::size_t>(i)];
    map->Place(submap, stored.X_WM.at(submap->id()));
  }
  PlanBenchRow row{NameOf(PlannerKindNames(), kind), submaps, 0, 0, 0, 0};
  PlannerOptions options = settings.planner;
  options.kind = kind;
  const auto planner = MakeViewPlanner(options, settings.limits, settings.sonar,
                                       settings.exploration.box_W(), settings.mission.seed);
  std::vector<double> times_ms;
  for (int plan = -1; plan < plans; ++plan) {
    // Spread over the flight, the newest last.
    const int at = (submaps - 1) * (plan + 1) / std::max(1, plans);
    const SubmapPtr& submap = stored.submaps[static_cast<std::size_t>(at)];
    const Waypoint from = WaypointOf(stored.X_WM.at(submap->id()));
    CollisionChecker checker(settings.planner.collision_rules());
    checker.SetBubble(
        {stored.X_WM.begin()->second.translation(), settings.planner.bubble_radius_m});
    checker.SetPresence(from, stored.voxel_size_m);
    const Stopwatch stopwatch;
    const ViewPlan found = planner->Plan(*map, checker, from);
    if (plan < 0) continue;  // It filled the caches.
    times_ms.push_back(1e3 * stopwatch.seconds());
    ++row.plans;
    row.paths += found.outcome == ViewPlan::Outcome::kGo;
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
  for (const int size : SizesOf(options, static_cast<int>(stored.submaps.size())))
    for (const PlannerKind kind : {PlannerKind::kCoverage, PlannerKind::kNextBestView})
      rows.push_back(Measure(kind, settings, stored, size, options.plans));
  return rows;
}

}  // namespace vog
