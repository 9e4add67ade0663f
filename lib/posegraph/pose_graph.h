#pragma once

#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "lib/base/config.h"
#include "lib/geometry/pose.h"
#include "lib/posegraph/constraint.h"

namespace vog {

struct PoseGraphOptions {
  int max_iterations = 30;
  double function_tolerance = 1e-8;

  void Visit(OptionsVisitor& v) {
    v("max_iterations", max_iterations, Between(1, 10000), "of the solver, a solve");
    v("function_tolerance", function_tolerance, Between(0, 1),
      "stop when the cost falls by a smaller share");
  }
};

/// What the squared whitened residual s of a constraint counts for in the cost: dynamic covariance
/// scaling [Agarwal et al. 2013] as a loss, s up to phi, then phi (3 s - phi) / (s + phi). No
/// constraint counts for more than 3 phi; with an infinite one all count for s.
struct DcsLoss {
  double phi = std::numeric_limits<double>::infinity();
};

/// How a solve ended.
struct SolveSummary {
  bool usable = false;                      ///< False: the poses are those of before.
  double initial_cost = 0, final_cost = 0;  ///< Sums of squared whitened residuals, no 1/2.
  int iterations = 0;
};

/// A pose graph: the maximum a posteriori estimate of eq. 6 by Ceres, with unary priors on z, roll
/// and pitch. The node with the smallest number stays where it is.
class PoseGraph {
 public:
  explicit PoseGraph(const PoseGraphOptions& options) : options_(options) {}

  /// @pre `id` is new.
  void AddNode(NodeId id, const Pose3& X_W);
  /// Moves a node to where the next solve shall start. @pre it is there.
  void SetPose(NodeId id, const Pose3& X_W) { nodes_.at(id) = X_W; }
  /// Holds a node where it is, as the one with the smallest number. @pre it is there.
  void Fix(NodeId id) { fixed_.insert(id); }
  bool IsFixed(NodeId id) const { return id == nodes_.begin()->first || fixed_.count(id) > 0; }
  void SetPrior(NodeId id, const AbsolutePrior& prior) { priors_[id] = prior; }
  /// @pre both nodes are there. Returns the constraint's number.
  int AddConstraint(const Constraint& constraint);
  /// Its number is not used again.
  void RemoveConstraint(int number) { constraints_.erase(number); }

  /// With `closure_loss` closures that contradict the rest weigh less, and costs are after it.
  SolveSummary Solve(DcsLoss closure_loss = {});

  /// Sum of the squared whitened residuals at the present poses.
  double Cost() const;
  /// Squared whitened residual of a constraint at the present poses: chi-square with as many
  /// degrees of freedom as its whitening has rows.
  double ChiSquareOf(const Constraint& constraint) const;

  /// Covariance of X_ik = X_Wi^-1 * X_Wk for each pair (i, k), right perturbation. One
  /// factorisation, the diagonal of the inverse, and six solves for each k. Empty when the graph
  /// does not determine all poses.
  std::vector<Mat6> RelativeCovariances(const std::vector<std::pair<NodeId, NodeId>>& pairs) const;

  const Pose3& X_W(NodeId id) const { return nodes_.at(id); }
  const std::map<NodeId, Pose3>& nodes() const { return nodes_; }
  const std::map<int, Constraint>& constraints() const { return constraints_; }

 private:
  PoseGraphOptions options_;
  std::map<NodeId, Pose3> nodes_;
  std::map<NodeId, AbsolutePrior> priors_;
  std::map<int, Constraint> constraints_;
  std::set<NodeId> fixed_;
  int next_constraint_ = 0;
};

}  // namespace vog
