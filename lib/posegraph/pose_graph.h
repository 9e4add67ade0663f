#pragma once

#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lib/base/config.h"
#include "lib/posegraph/graph_data.h"
#include "lib/posegraph/kept_factor.h"

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

/// A pose graph: the maximum a posteriori estimate of eq. 6 with unary priors on z, roll and pitch.
/// The node with the smallest number stays where it is.
///
/// The first solve is Ceres'. After it a factor is kept between calls, of which solves and
/// covariances make use while the graph changes by a node and some constraints at a time. The same
/// calls give the same bits. Const calls change that factor too: no two threads at a time.
class PoseGraph {
 public:
  explicit PoseGraph(const PoseGraphOptions& options) : options_(options) {}

  /// @pre `id` is new.
  void AddNode(NodeId id, const Pose3& X_W);
  /// Moves a node to where the next solve, which is Ceres', shall start. @pre it is there.
  void SetPose(NodeId id, const Pose3& X_W);
  /// Holds a node where it is, as the one with the smallest number. @pre it is there.
  void Fix(NodeId id);
  bool IsFixed(NodeId id) const { return graph_.IsFixed(id); }
  void SetPrior(NodeId id, const AbsolutePrior& prior);
  /// @pre both nodes are there. Returns the constraint's number.
  int AddConstraint(const Constraint& constraint);
  /// Its number is not used again.
  void RemoveConstraint(int number);

  /// With `closure_loss` closures that contradict the rest weigh less, and costs are after it. A
  /// solve after another without loss costs a few products with the kept factor: it ends where the
  /// cost is as low as Ceres would have it, or else Ceres is asked.
  SolveSummary Solve(DcsLoss closure_loss = {});

  /// Sum of the squared whitened residuals at the present poses.
  double Cost() const;
  /// Squared whitened residual of a constraint at the present poses: chi-square with as many
  /// degrees of freedom as its whitening has rows.
  double ChiSquareOf(const Constraint& constraint) const;

  using NodePair = std::pair<NodeId, NodeId>;
  /// Covariance of X_ik = X_Wi^-1 * X_Wk for each pair (i, k), right perturbation. Of a few pairs:
  /// half a solve each with the kept factor, if it is of the present poses. Of many: once the
  /// inverse's diagonal blocks, and a solve for each k that is asked relative to a node that is not
  /// fixed. Empty when the graph does not determine all poses.
  std::vector<Mat6> RelativeCovariances(const std::vector<NodePair>& pairs) const;
  /// The same to some percent: derivatives may be those at poses a few centimetres beside the
  /// present ones. While the graph changes by a node and some constraints at a time, that spares
  /// most factorisations.
  std::vector<Mat6> RoughRelativeCovariances(const std::vector<NodePair>& pairs) const;

  const Pose3& X_W(NodeId id) const { return graph_.nodes.at(id); }
  const std::map<NodeId, Pose3>& nodes() const { return graph_.nodes; }
  const std::map<int, Constraint>& constraints() const { return graph_.constraints; }

 private:
  SolveSummary SolveFromAnywhere(const DcsLoss& closure_loss);
  std::optional<SolveSummary> SolveNearby();
  /// Whether the steps that a factor may take suffice.
  bool StepWithFactor(SolveSummary& summary);
  /// Makes the factor follow the graph, or makes it anew. False when the poses are not determined.
  bool KeepFactor() const;
  /// The same, so that it is of the present poses.
  bool KeepExactFactor() const;
  /// The same of poses near by.
  bool KeepNearFactor() const;
  /// Covariances of X_ik at the factor's poses, carried over to the present ones. @pre there is a
  /// factor.
  std::vector<Mat6> CovariancesByFactor(const std::vector<NodePair>& pairs) const;
  /// Derivatives of X_ik by the poses, transposed.
  Eigen::MatrixXd DerivativesOf(const NodePair& pair) const;
  /// Whether the covariances of so many pairs are cheaper from the inverse's columns.
  bool AreMany(const std::vector<NodePair>& pairs) const;
  std::vector<Mat6> CovariancesByColumns(const std::vector<NodePair>& pairs) const;

  PoseGraphOptions options_;
  GraphData graph_;
  int next_constraint_ = 0;
  bool is_near_optimum_ = false;              ///< What has changed since the last solve is little.
  mutable std::optional<KeptFactor> factor_;  ///< Maybe of poses and constraints before.
};

/// The numbers of a graph's constraints that are not odometry, ascending.
std::vector<int> ClosuresOf(const PoseGraph& graph);

}  // namespace vog
