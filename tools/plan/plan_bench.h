#pragma once

#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/planner/planner_options.h"

namespace vog {

struct PlanBenchOptions {
  std::string map;           ///< A map's folder.
  std::vector<int> submaps;  ///< Sizes of the map to plan on; empty: some up to the whole.
  int plans = 20;            ///< For each size and planner, one a submap at most.
};

/// Times of one planner on a map of so many submaps.
struct PlanBenchRow {
  std::string planner;
  int submaps = 0;
  int plans = 0, paths = 0;  ///< Asked for, and those that led somewhere.
  double median_ms = 0, worst_ms = 0;
};

/// Flies along a saved map with each planner of views: its submaps come one by one, and from the
/// base of each a path is planned. A row for each size: wall time of the last steps that led up to
/// it. What a new submap changes of the map's caches is in it, a closure that moves all is not.
/// @throws UsageError for a map that cannot be read.
std::vector<PlanBenchRow> RunPlanBench(const PlanBenchOptions& options, const Config& config);

}  // namespace vog
