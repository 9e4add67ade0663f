#include "lib/posegraph/kept_factor.h"

#include <algorithm>

#include "lib/posegraph/residual.h"

namespace vog {
namespace {

/// Pivots below this share of their diagonal entry are rounding errors: a pose is free.
constexpr double kSingularPivot = 1e-14;
/// Corrections that leave fewer digits than this would have to be made up for by iterations.
constexpr double kSingularCorrection = 1e-10;
/// A constraint's information, seen in W, changes with its pose: the turn turns it, the shift moves
/// the arm at which rotations act on places some metres away.
constexpr double kNear_m = 0.1, kNear_rad = 0.02;

}  // namespace

std::optional<KeptFactor> KeptFactor::Of(const GraphData& graph) {
  KeptFactor kept;
  kept.rows_ = NodeRows(graph);
  for (const auto& [id, X_W] : graph.nodes)
    if (graph.IsFixed(id)) {
      kept.fixed_X_W_.emplace(id, X_W);
    } else {
      kept.X_W_.push_back(X_W);
    }
  if (!graph.constraints.empty()) kept.last_constraint_ = graph.constraints.rbegin()->first;
  auto factor = std::make_shared<BlockCholesky<6>>();
  if (!factor->Factor(NormalEquations(graph, kept.rows_).Hessian()) ||
      factor->SmallestPivot() < kSingularPivot)
    return std::nullopt;
  kept.factor_ = std::move(factor);
  return kept;
}

void KeptFactor::Remove(int number, const Constraint& constraint) {
  if (number <= last_constraint_) gone_.push_back(CorrectionOf(constraint, -1));
}

bool KeptFactor::Follow(const GraphData& graph) {
  std::vector<Correction> changes = std::exchange(gone_, {});
  has_lost_ = has_lost_ || !changes.empty();
  const int old_rows = rows_.size();
  const auto first_new = graph.constraints.upper_bound(last_constraint_);
  for (auto constraint = first_new; constraint != graph.constraints.end(); ++constraint) {
    if (!Add(constraint->second, graph, changes)) return false;
    last_constraint_ = constraint->first;
  }
  if (X_W_.size() + fixed_X_W_.size() != graph.nodes.size()) return false;
  for (int row = old_rows; row < rows_.size(); ++row) {
    const NodeId id = rows_.ids()[static_cast<std::size_t>(row)];
    const auto prior = graph.priors.find(id);
    if (prior == graph.priors.end()) continue;
    changes.push_back({1, row, std::nullopt, ErrorOf(prior->second, PoseOf(id)).by_pose, {}});
  }
  return Correct(changes);
}

bool KeptFactor::Add(const Constraint& constraint, const GraphData& graph,
                     std::vector<Correction>& changes) {
  const bool knows_from = Knows(constraint.from), knows_to = Knows(constraint.to);
  if (!knows_from && !knows_to) return false;
  if (knows_from && knows_to) {
    changes.push_back(CorrectionOf(constraint, 1));
    return true;
  }
  const NodeId id = knows_from ? constraint.to : constraint.from;
  return AddLeaf(constraint, id, graph.nodes.at(id));
}

bool KeptFactor::AddLeaf(const Constraint& constraint, NodeId id, const Pose3& X_W) {
  X_W_.push_back(X_W);
  rows_.Append(id);
  const Correction rows = CorrectionOf(constraint, 1);
  const bool is_from = constraint.from == id;
  const Eigen::FullPivLU<Eigen::MatrixXd> J_n(is_from ? rows.by_i : rows.by_k);
  if (J_n.rows() < 6 || !J_n.isInvertible()) return false;
  const auto parent = rows_.Of(is_from ? constraint.to : constraint.from);
  const Leaf& leaf =
      leaves_.emplace_back(Leaf{parent, J_n.inverse(), is_from ? rows.by_k : rows.by_i});
  if (!HasMarginals()) return true;
  Mat6 covariance = Mat6::Identity();
  if (parent)
    covariance += leaf.J_p * marginals_[static_cast<std::size_t>(*parent)] * leaf.J_p.transpose();
  marginals_.push_back(leaf.J_n_inverse * covariance * leaf.J_n_inverse.transpose());
  return true;
}

KeptFactor::Correction KeptFactor::CorrectionOf(const Constraint& constraint, double sign) const {
  const RelativeError e = ErrorOf(constraint, PoseOf(constraint.from), PoseOf(constraint.to));
  return {sign, rows_.Of(constraint.from), rows_.Of(constraint.to), constraint.whitening * e.by_i,
          constraint.whitening * e.by_k};
}

/// (H + U C U^T)^-1 = H^-1 - H^-1 U (C^-1 + U^T H^-1 U)^-1 U^T H^-1 with H = K K^T.
bool KeptFactor::Correct(const std::vector<Correction>& changes) {
  Eigen::Index more = 0;
  for (const Correction& change : changes) more += change.by_i.rows();
  if (more == 0) return true;
  // Worth it while the corrections cost no more than the factor's own solve.
  const double numbers = 6.0 * rows_.size();
  if (numbers * static_cast<double>(rank() + more) > factor_->entries()) return false;

  Eigen::MatrixXd U = Eigen::MatrixXd::Zero(6 * rows_.size(), more);
  Eigen::VectorXd signs(more);
  Eigen::Index column = 0;
  for (const Correction& change : changes) {
    const Eigen::Index rows = change.by_i.rows();
    if (change.i) U.block(6 * *change.i, column, 6, rows) += change.by_i.transpose();
    if (change.k) U.block(6 * *change.k, column, 6, rows) += change.by_k.transpose();
    signs.segment(column, rows).setConstant(change.sign);
    column += rows;
  }
  const Eigen::MatrixXd Y = SolveLower(std::move(U));
  if (HasMarginals()) CorrectMarginals(Y, signs);
  const Eigen::MatrixXd with_old = YTransposed(Y);
  const Eigen::Index old = S_.rows();
  S_.conservativeResize(old + more, old + more);
  S_.topRightCorner(old, more) = with_old;
  S_.bottomLeftCorner(more, old) = with_old.transpose();
  S_.bottomRightCorner(more, more) = Y.transpose() * Y;
  S_.diagonal().tail(more) += signs;
  Y_.push_back(Y);
  S_factor_.compute(S_);
  return S_factor_.rcond() > kSingularCorrection;
}

/// P' = P - W (C^-1 + U^T W)^-1 W^T with P = H^-1 before and W = P U: of its diagonal blocks.
void KeptFactor::CorrectMarginals(const Eigen::MatrixXd& Y, const Eigen::VectorXd& signs) {
  const Eigen::MatrixXd corrected = Corrected(Y);
  const Eigen::MatrixXd W = SolveUpper(corrected);
  Eigen::MatrixXd S = Y.transpose() * corrected;
  S.diagonal() += signs;
  const Eigen::MatrixXd by_rows = S.partialPivLu().solve(W.transpose());
  for (std::size_t row = 0; row < marginals_.size(); ++row) {
    const auto at = 6 * static_cast<Eigen::Index>(row);
    marginals_[row] -= W.middleRows<6>(at) * by_rows.middleCols<6>(at);
  }
}

const Pose3& KeptFactor::PoseOf(NodeId id) const {
  const auto row = rows_.Of(id);
  return row ? X_W_[static_cast<std::size_t>(*row)] : fixed_X_W_.at(id);
}

bool KeptFactor::IsExactFor(const GraphData& graph) const {
  return !has_lost_ && std::all_of(graph.nodes.begin(), graph.nodes.end(), [&](const auto& node) {
    return Knows(node.first) && PoseOf(node.first).matrix() == node.second.matrix();
  });
}

bool KeptFactor::IsNear(const GraphData& graph) const {
  return !has_lost_ && std::all_of(graph.nodes.begin(), graph.nodes.end(), [&](const auto& node) {
    if (!Knows(node.first)) return false;
    const Vec6 moved = Log(Ominus(PoseOf(node.first), node.second));
    return moved.head<3>().norm() < kNear_m && moved.tail<3>().norm() < kNear_rad;
  });
}

Eigen::MatrixXd KeptFactor::SolveLower(Eigen::MatrixXd B) const {
  const Eigen::Index of_factor = B.rows() - 6 * static_cast<Eigen::Index>(leaves_.size());
  Eigen::Index row = B.rows();
  for (auto leaf = leaves_.rbegin(); leaf != leaves_.rend(); ++leaf) {
    row -= 6;
    auto own = B.middleRows<6>(row);
    own = leaf->J_n_inverse.transpose() * own.eval();
    if (leaf->parent) B.middleRows<6>(6 * *leaf->parent) -= leaf->J_p.transpose() * own;
  }
  B.topRows(of_factor) = factor_->SolveLower(B.topRows(of_factor));
  return B;
}

Eigen::MatrixXd KeptFactor::SolveUpper(const Eigen::MatrixXd& Z) const {
  Eigen::Index row = Z.rows() - 6 * static_cast<Eigen::Index>(leaves_.size());
  Eigen::MatrixXd X(Z.rows(), Z.cols());
  X.topRows(row) = factor_->SolveUpper(Z.topRows(row));
  for (const Leaf& leaf : leaves_) {
    Eigen::MatrixXd own = Z.middleRows<6>(row);
    if (leaf.parent) own -= leaf.J_p * X.middleRows<6>(6 * *leaf.parent);
    X.middleRows<6>(row) = leaf.J_n_inverse * own;
    row += 6;
  }
  return X;
}

Eigen::MatrixXd KeptFactor::YTransposed(const Eigen::MatrixXd& Z) const {
  Eigen::MatrixXd product(rank(), Z.cols());
  Eigen::Index row = 0;
  for (const Eigen::MatrixXd& Y : Y_) {
    product.middleRows(row, Y.cols()).noalias() = Y.transpose() * Z.topRows(Y.rows());
    row += Y.cols();
  }
  return product;
}

Eigen::MatrixXd KeptFactor::Corrected(Eigen::MatrixXd Z) const {
  if (rank() == 0) return Z;
  const Eigen::MatrixXd s = S_factor_.solve(YTransposed(Z));
  Eigen::Index row = 0;
  for (const Eigen::MatrixXd& Y : Y_) {
    Z.topRows(Y.rows()).noalias() -= Y * s.middleRows(row, Y.cols());
    row += Y.cols();
  }
  return Z;
}

Eigen::MatrixXd KeptFactor::Solve(const Eigen::MatrixXd& B) const {
  return SolveUpper(Corrected(SolveLower(B)));
}

Eigen::VectorXd KeptFactor::Solve(const Eigen::VectorXd& b, const std::vector<Pose3>& X_W) const {
  // A perturbation at the old pose is Ad(X^-1 X_old) times as one at the present pose.
  std::vector<Mat6> carry(X_W.size());
  Eigen::MatrixXd z(b.rows(), 1);
  for (std::size_t row = 0; row < X_W.size(); ++row) {
    const auto at = 6 * static_cast<Eigen::Index>(row);
    carry[row] = AdjointOf(Ominus(X_W[row], X_W_[row]));
    z.middleRows<6>(at) = carry[row].transpose() * b.segment<6>(at);
  }
  Eigen::VectorXd x = Solve(z);
  for (std::size_t row = 0; row < X_W.size(); ++row) {
    const auto at = 6 * static_cast<Eigen::Index>(row);
    x.segment<6>(at) = (carry[row] * x.segment<6>(at)).eval();
  }
  return x;
}

Eigen::MatrixXd KeptFactor::InverseOf(const Eigen::MatrixXd& B) const {
  const Eigen::MatrixXd Z = SolveLower(B);
  Eigen::MatrixXd inverse = Z.transpose() * Z;
  if (rank() > 0) {
    const Eigen::MatrixXd in_corrections = YTransposed(Z);
    inverse -= in_corrections.transpose() * S_factor_.solve(in_corrections);
  }
  return inverse;
}

}  // namespace vog
