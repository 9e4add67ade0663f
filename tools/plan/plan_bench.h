#pragma once

#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/planner/planner_options.h"

namespace vog {

struct PlanBenchOptions {
  std::string map;           ///< A map's folder.
  std::vector<int> submaps;  ///< Sizes of the map to plan on; empty: some up to the whole.
  int plans = 20;            ///< For each size and planner.
};

/// Times of one planner on a map of so many submaps.
struct PlanBenchRow {
  std::string planner;
  int submaps = 0;
  int plans = 0, paths = 0;  ///< Asked for, and those that led somewhere.
  double median_ms = 0, worst_ms = 0;
};

/// Plans on the first submaps of a saved map, from bases of submaps spread over them, with each
/// planner of views. Wall time of a planning step, the map's caches filled. @throws UsageError for
/// a map that cannot be read.
std::vector<PlanBenchRow> RunPlanBench(const PlanBenchOptions& options, const Config& config);

}  // namespace vog
