#pragma once

#include <Eigen/LU>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "lib/posegraph/block_cholesky.h"
#include "lib/posegraph/graph_data.h"
#include "lib/posegraph/normal_equations.h"

namespace vog {

/// H = J^T J of a graph at some poses, factored once, and kept while the graph changes a little:
///
/// - A node that comes with a constraint of six directions is eliminated before all others. Nothing
///   then remains of the two, so that the factor only gets a leaf.
/// - What else comes or goes are corrections of low rank, H' = H +- U U^T [Woodbury 1950].
///
/// Derivatives stay those at the poses that a node had when the factor learned of it. What makes H
/// useful afterwards is that perturbations are carried over to the present poses as motions in W:
/// then to move a part of the graph as a whole still costs nothing within that part.
class KeptFactor {
 public:
  /// Nothing when the graph does not determine all poses.
  static std::optional<KeptFactor> Of(const GraphData& graph);

  /// Call before a constraint is taken out of the graph.
  void Remove(int number, const Constraint& constraint);
  /// Takes in what has come and gone in `graph` since the last call. False when that is too much to
  /// be worth it, or the poses are not determined any more: then the factor is of no more use. @pre
  /// what else has changed in the graph is poses.
  bool Follow(const GraphData& graph);

  bool Knows(NodeId id) const { return rows_.Of(id) || fixed_X_W_.count(id) > 0; }
  /// Whether it is H at the poses of `graph`, the graph of the last Follow(), up to rounding.
  bool IsExactFor(const GraphData& graph) const;
  /// Whether the poses of that graph are so near those at which derivatives were taken that the
  /// covariances are the same but for some percent.
  bool IsNear(const GraphData& graph) const;
  /// Whether it is as Of() made it.
  bool IsPlain() const { return leaves_.empty() && rank() == 0; }

  const NodeRows& rows() const { return rows_; }
  /// Where derivatives are taken.
  const Pose3& PoseOf(NodeId id) const;
  /// H^-1 b, both perturbations of the poses X_W, which stand by row.
  Eigen::VectorXd Solve(const Eigen::VectorXd& b, const std::vector<Pose3>& X_W) const;
  /// H^-1 B at the poses where derivatives are taken.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;
  /// B^T H^-1 B there, for half the work.
  Eigen::MatrixXd InverseOf(const Eigen::MatrixXd& B) const;

  bool HasMarginals() const { return !marginals_.empty(); }
  /// Finds the diagonal blocks of H^-1 there, twice the work of a factorisation. From then on
  /// Follow() keeps them, for the work of a solve for each row that comes or goes. @pre IsPlain().
  void FindMarginals() { marginals_ = factor_->Inverse().diagonal; }
  /// By row. @pre HasMarginals().
  const std::vector<Mat6>& marginals() const { return marginals_; }

 private:
  /// A node n and the constraint, J_p to its parent p, that it came with.
  struct Leaf {
    std::optional<int> parent;  ///< Row; nothing when it is fixed.
    Mat6 J_n_inverse, J_p;
  };
  /// Rows of J.
  struct Correction {
    double sign;  ///< 1 where it has come, -1 where it has gone.
    std::optional<int> i, k;
    Eigen::MatrixXd by_i, by_k;
  };

  KeptFactor() = default;
  bool Add(const Constraint& constraint, const GraphData& graph, std::vector<Correction>& changes);
  bool AddLeaf(const Constraint& constraint, NodeId id, const Pose3& X_W);
  Correction CorrectionOf(const Constraint& constraint, double sign) const;
  bool Correct(const std::vector<Correction>& changes);
  int rank() const { return static_cast<int>(S_.rows()); }

  /// The factor with leaves, H = K K^T before corrections.
  Eigen::MatrixXd SolveLower(Eigen::MatrixXd B) const;
  Eigen::MatrixXd SolveUpper(const Eigen::MatrixXd& Z) const;
  /// Y^T Z with Y = K^-1 U.
  Eigen::MatrixXd YTransposed(const Eigen::MatrixXd& Z) const;
  /// (1 - Y S^-1 Y^T) Z, the corrections' part of a solve.
  Eigen::MatrixXd Corrected(Eigen::MatrixXd Z) const;
  /// What rows with Y = K^-1 U that come or go by `signs` tell of the marginals. Call before they
  /// are among the corrections.
  void CorrectMarginals(const Eigen::MatrixXd& Y, const Eigen::VectorXd& signs);

  std::shared_ptr<const BlockCholesky<6>> factor_;  ///< Never changes: copies share it.
  NodeRows rows_;                                   ///< Those of factor_, then the leaves.
  std::vector<Leaf> leaves_;
  std::vector<Mat6> marginals_;        ///< By row; none before they are asked for.
  std::vector<Pose3> X_W_;             ///< Where derivatives are taken, by row.
  std::map<NodeId, Pose3> fixed_X_W_;  ///< The same of fixed nodes.
  int last_constraint_ = -1;           ///< That it has.
  bool has_lost_ = false;              ///< Corrections with sign -1 have taken precision away.

  std::vector<Correction> gone_;    ///< Since the last Follow().
  std::vector<Eigen::MatrixXd> Y_;  ///< Side by side; rows of leaves that came later are zero.
  Eigen::MatrixXd S_;               ///< +-1 + Y^T Y.
  Eigen::PartialPivLU<Eigen::MatrixXd> S_factor_;
};

}  // namespace vog
