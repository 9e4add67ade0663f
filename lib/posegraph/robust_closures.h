#pragma once

#include <vector>

#include "lib/posegraph/pose_graph.h"

namespace vog {

/// What became of a graph's closures.
struct RobustSummary {
  SolveSummary solve;         ///< The last one, of what was kept.
  int iterations = 0;         ///< Of all solves.
  std::vector<int> rejected;  ///< Numbers of the constraints that were removed, ascending.
};

/// Solves a graph some or most of whose closures may be wrong, and removes those:
///
/// 1. The poses become those of odometry alone.
/// 2. A closure that contradicts the chain of odometry between its nodes is removed: chi-square, 99
///    %, against the chain's covariance plus its own.
/// 3. The rest is solved with dynamic covariance scaling, which lets the closures that agree with
///    one another win; its Phi falls to 6 from where no closure is doubted.
/// 4. Closures that contradict the solution (chi-square, 99 %) are removed, and what is left is
///    solved without a loss.
///
/// Many published graphs state covariances that are a thousand or a million times too large, which
/// no test by chi-square survives. The closures themselves show that, most of them lying far below
/// the limits of steps 2 and 4, which are then lowered. At least a tenth of all closures must be
/// right for that, and half of those that pass step 2.
///
/// Odometry is the constraints of that kind between nodes whose numbers follow one another; where
/// it has a gap the poses are taken as they are, and closures over it skip step 2. Wrong closures
/// that agree among themselves and contradict little else are not found.
RobustSummary SolveRobustly(PoseGraph& graph);

}  // namespace vog
