#pragma once

#include <cstdint>
#include <vector>

#include "tools/graph/outlier_trial.h"

namespace vog {

struct GraphBenchOptions {
  OutlierOptions outliers;
  std::vector<double> shares = {0.1, 0.2, 0.4, 0.6, 0.8};  ///< Of wrong closures among all.
  std::int64_t first_seed = 1, last_seed = 10;
  int resolved = 100;  ///< Closures that come one at a time, each followed by a solve.
  bool json = false;
};

/// Adds wrong closures to a graph, solves robustly, and prints a table or JSON: how many of the
/// wrong and of the true ones are kept, and how far the trajectory is from the one solved without
/// wrong ones; and what it costs to solve again after a new closure. @throws as OutlierTrial() and
/// MeasureResolve().
void BenchGraph(const PoseGraph& graph, const GraphBenchOptions& options);

}  // namespace vog
