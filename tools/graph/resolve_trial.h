#pragma once

#include "lib/posegraph/pose_graph.h"

namespace vog {

/// What solving again after a new closure costs, and how close it comes to a batch solve.
struct ResolveResult {
  int closures = 0;  ///< That came one at a time.
  double median_ms = 0, p95_ms = 0, worst_ms = 0;
  double batch_ms = 0;                 ///< Median of batch solves from the same poses.
  double largest_cost_difference = 0;  ///< From the batch solve's, as a share of it.
};

/// Takes the last `closures` of a graph's away, solves, and gives them back one at a time, each
/// followed by a solve; for some of them a batch solve from the same poses is made as well.
/// @throws UsageError when `graph` has no closures, std::runtime_error when it cannot be solved.
ResolveResult MeasureResolve(PoseGraph graph, int closures);

}  // namespace vog
