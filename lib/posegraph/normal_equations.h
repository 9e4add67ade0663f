#pragma once

#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "lib/posegraph/block_cholesky.h"
#include "lib/posegraph/constraint.h"

namespace vog {

/// A pose as the solver moves it: q_WB, p_WB.
struct NodeState {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Vec3 p = Vec3::Zero();

  static NodeState From(const Pose3& X) {
    return {Eigen::Quaterniond(X.linear()), X.translation()};
  }
  Pose3 ToPose() const { return MakePose(p, q); }
  /// Perturbed on the right by (translation, rotation), to first order.
  NodeState Moved(const Vec6& xi) const;
};
using NodeStates = std::vector<NodeState>;

/// What the squared whitened residual s of a constraint counts for in the cost: dynamic covariance
/// scaling [Agarwal et al. 2013] as a loss, s up to phi, then phi (3 s - phi) / (s + phi). No
/// constraint counts for more than 3 phi; with an infinite one all count for s.
struct DcsLoss {
  double phi = std::numeric_limits<double>::infinity();

  double ValueOf(double s) const { return s <= phi ? s : phi * (3 * s - phi) / (s + phi); }
  /// The derivative, in (0, 1]: the constraint's weight in a step.
  double WeightOf(double s) const {
    return s <= phi ? 1 : 4 * (phi / (phi + s)) * (phi / (phi + s));
  }
};

/// The residual of a Constraint before whitening. To first order in the error it is Log(), whose
/// translation part is taken without the rotation's Jacobian.
Vec6 ErrorOf(const NodeState& X_ik, const NodeState& X_Wi, const NodeState& X_Wk);

/// The Gauss-Newton equations H step = -g of a pose graph, and H's factor. Both are kept from one
/// linearisation to the next. g is exact. A constraint's part of H is made anew when the relative
/// pose, which alone it depends on, has changed by a thousandth: parts of the graph that move as a
/// whole cost nothing.
class NormalEquations {
 public:
  /// Nodes are numbered 0, 1, ... as they come.
  void AddNode();
  /// A fixed node has no step and no covariance.
  void SetFixed(int node, bool is_fixed);

  /// Between nodes i and k. @pre `number` is new.
  void AddConstraint(int number, int i, int k, const Constraint& constraint);
  void RemoveConstraint(int number);
  void SetPrior(int node, const AbsolutePrior& prior);
  /// That of all closures.
  void SetLoss(DcsLoss loss) { closure_loss_ = loss; }

  /// The sum of what all squared whitened residuals count for.
  double CostAt(const NodeStates& states) const;
  /// Linearises; returns the cost.
  double Linearize(const NodeStates& states);
  /// Factors H + damping * diag(H). False when that is not positive definite.
  bool Factor(double damping);

  // All below: @pre the last Factor() was true.

  /// The solution of the equations, six rows a node.
  Eigen::VectorXd Step() const { return factor_.Solve(-gradient_); }
  /// By how much the cost falls with `step`, to second order.
  double PredictedDecrease(const Eigen::VectorXd& step) const;
  double damping() const { return damping_; }
  const BlockCholesky<6>& factor() const { return factor_; }

 private:
  struct RelativeTerm {
    int i, k;
    NodeState X_ik;
    Mat6 information;
    bool is_closure;
    std::size_t block;  ///< Of H; its row is the smaller of i and k.
    // Its part of H, and where it was linearised.
    NodeState X_ik_then;
    double weight = -1;  ///< Negative: never linearised.
    Mat6 H_ii, H_ik, H_kk;
  };
  struct PriorTerm {
    AbsolutePrior prior;
    Vec3 up_B;  ///< The vertical, seen from the body, as measured.
    Vec3 up_B_then = Vec3::Zero();
    Mat6 H;
  };

  static bool HasChanged(const RelativeTerm& term, const NodeState& X_ik, double weight);
  static Vec3 PriorError(const PriorTerm& term, const NodeState& X_WB);
  DcsLoss LossOf(const RelativeTerm& term) const;
  double Linearize(const NodeStates& states, RelativeTerm& term);
  double Linearize(const NodeState& X_WB, int node, PriorTerm& term);
  bool IsFixed(int node) const { return is_fixed_[static_cast<std::size_t>(node)]; }
  void Touch(int node) { is_changed_[static_cast<std::size_t>(node)] = true; }
  void Touch(const RelativeTerm& term);
  void Assemble();

  std::map<int, RelativeTerm> terms_;
  std::map<int, PriorTerm> priors_;
  std::vector<bool> is_fixed_;
  std::vector<bool> is_changed_;  ///< H has other blocks at this node than the factored matrix.
  DcsLoss closure_loss_;
  std::map<std::pair<int, int>, std::size_t> blocks_;
  BlockMatrix<6> H_;
  Eigen::VectorXd gradient_;
  BlockCholesky<6> factor_;
  double damping_ = 0;  ///< Of the factor.
};

}  // namespace vog
