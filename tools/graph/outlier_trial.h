#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/random.h"
#include "lib/posegraph/pose_graph.h"

namespace vog {

/// Which closures a trial keeps of a graph, and what its wrong ones are like.
struct OutlierOptions {
  int closures = 100;  ///< True ones, picked at random; all when the graph has fewer.
  int group = 1;       ///< Wrong ones of neighbouring nodes that share one wrong registration.
  /// How far [m] a wrong registration is from the truth; 0: anywhere, the relative pose of two
  /// other nodes.
  double shift_m = 0;
};

/// What became of a trial's closures, and how far the trajectory is from the one that is solved
/// without wrong ones.
struct OutlierResult {
  int right = 0, right_kept = 0, wrong = 0, wrong_kept = 0;
  double max_m = 0, rmse_m = 0;
  double seconds = 0;  ///< Of the robust solve.
};

/// Odometry of a graph and some of its closures, to which wrong ones are added.
class OutlierTrial {
 public:
  /// Solves without wrong closures: that solution is the truth. @throws UsageError when `graph` has
  /// no closures or fewer than four nodes, std::runtime_error when it cannot be solved.
  OutlierTrial(const PoseGraph& graph, const OutlierOptions& options, std::uint64_t seed);

  /// Adds so many wrong closures that they are `share` of all, and solves robustly.
  OutlierResult Run(double share) const;

 private:
  /// A graph with `count` wrong closures more than the truth has.
  PoseGraph WithWrongClosures(int count, Random& random) const;
  std::vector<Constraint> WrongGroup(int size, Random& random) const;
  Pose3 WrongRegistration(NodeId i, NodeId k, Random& random) const;

  OutlierOptions options_;
  std::uint64_t seed_;
  PoseGraph truth_;
  std::vector<NodeId> ids_;
  std::vector<Constraint> closures_;  ///< Of the truth.
  double step_m_ = 0;                 ///< Mean length of an odometry step.
};

}  // namespace vog
