#include "lib/posegraph/pose_graph.h"

#include <ceres/ceres.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "lib/posegraph/residual.h"

namespace vog {
namespace {

/// x, y, z, qx, qy, qz, qw.
using PoseBlock = std::array<double, 7>;
constexpr int kPoseSize = 7, kTangentSize = 6;
/// Graphs with more nodes than this are factored by CHOLMOD, whose dense parts BLAS computes.
/// Smaller ones need no BLAS: what a mission computes does not depend on which one a machine has.
constexpr std::size_t kLarge = 1000;

template <class T>
using QuaternionMap = Eigen::Map<const Eigen::Quaternion<T>>;
template <class T>
using VectorMap = Eigen::Map<const Eigen::Matrix<T, 3, 1>>;

PoseBlock ToBlock(const Pose3& X) {
  PoseBlock block;
  Eigen::Map<Vec3>(block.data()) = X.translation();
  Eigen::Map<Eigen::Quaterniond>(block.data() + 3) = Eigen::Quaterniond(X.linear());
  return block;
}

Pose3 FromBlock(const double* block) {
  return MakePose(VectorMap<double>(block), QuaternionMap<double>(block + 3));
}

/// Poses perturbed on the right by (translation, rotation), so that Ceres' Jacobians and
/// covariances come out in our convention.
struct RightPerturbation {
  template <class T>
  bool Plus(const T* x, const T* delta, T* x_plus_delta) const {
    const QuaternionMap<T> q(x + 3);
    const VectorMap<T> rho(delta), phi(delta + 3);
    Eigen::Map<Eigen::Matrix<T, 3, 1>> position(x_plus_delta);
    Eigen::Map<Eigen::Quaternion<T>> rotation(x_plus_delta + 3);
    position = VectorMap<T>(x) + q * Eigen::Matrix<T, 3, 1>(rho);
    const Eigen::Quaternion<T> dq(T(1), phi[0] / T(2), phi[1] / T(2), phi[2] / T(2));
    rotation = (q * dq).normalized();
    return true;
  }

  template <class T>
  bool Minus(const T* y, const T* x, T* y_minus_x) const {
    const QuaternionMap<T> q_x(x + 3), q_y(y + 3);
    Eigen::Map<Eigen::Matrix<T, 3, 1>> rho(y_minus_x), phi(y_minus_x + 3);
    rho = q_x.conjugate() * Eigen::Matrix<T, 3, 1>(VectorMap<T>(y) - VectorMap<T>(x));
    const Eigen::Quaternion<T> dq = q_x.conjugate() * q_y;
    phi = T(2) * dq.vec() / dq.w();
    return true;
  }
};

/// Derivatives of RightPerturbation::Minus(y, x) by y at x.
Eigen::Matrix<double, kTangentSize, kPoseSize> MinusJacobian(const double* x) {
  const QuaternionMap<double> q(x + 3);
  Eigen::Matrix<double, kTangentSize, kPoseSize> J;
  J.setZero();
  J.topLeftCorner<3, 3>() = q.toRotationMatrix().transpose();
  J.block<3, 3>(3, 3) = 2 * (q.w() * Mat3::Identity() - SkewOf(q.vec()));
  J.bottomRightCorner<3, 1>() = -2 * q.vec();
  return J;
}

/// Writes derivatives by a perturbation where Ceres wants those by the seven numbers of `x`, which
/// it multiplies with the perturbation's own.
template <class ByPerturbation>
void WriteJacobian(const ByPerturbation& J, const double* x, double* jacobian) {
  if (jacobian == nullptr) return;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, kPoseSize, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(jacobian, J.rows(), kPoseSize) = J * MinusJacobian(x);
}

class ConstraintCost final : public ceres::CostFunction {
 public:
  /// `constraint` must stay.
  explicit ConstraintCost(const Constraint& constraint) : constraint_(constraint) {
    *mutable_parameter_block_sizes() = {kPoseSize, kPoseSize};
    set_num_residuals(static_cast<int>(constraint.whitening.rows()));
  }

  bool Evaluate(const double* const* poses, double* residuals, double** jacobians) const override {
    const Whitening& W = constraint_.whitening;
    const RelativeError e = ErrorOf(constraint_, FromBlock(poses[0]), FromBlock(poses[1]));
    Eigen::Map<Residual>(residuals, W.rows()) = W * e.error;
    if (jacobians == nullptr) return true;
    WriteJacobian(W * e.by_i, poses[0], jacobians[0]);
    WriteJacobian(W * e.by_k, poses[1], jacobians[1]);
    return true;
  }

 private:
  const Constraint& constraint_;
};

class PriorCost final : public ceres::SizedCostFunction<3, kPoseSize> {
 public:
  explicit PriorCost(const AbsolutePrior& prior) : prior_(prior) {}

  bool Evaluate(const double* const* poses, double* residuals, double** jacobians) const override {
    const AbsoluteError e = ErrorOf(prior_, FromBlock(poses[0]));
    Eigen::Map<Vec3>(residuals, 3) = e.residual;
    if (jacobians != nullptr) WriteJacobian(e.by_pose, poses[0], jacobians[0]);
    return true;
  }

 private:
  AbsolutePrior prior_;
};

/// DcsLoss for Ceres.
class DcsLossFunction final : public ceres::LossFunction {
 public:
  explicit DcsLossFunction(double phi) : phi_(phi) {}

  void Evaluate(double s, double rho[3]) const override {
    if (s <= phi_) {
      rho[0] = s;
      rho[1] = 1;
      rho[2] = 0;
      return;
    }
    const double ratio = phi_ / (phi_ + s);
    rho[0] = phi_ * (3 * s - phi_) / (s + phi_);
    rho[1] = 4 * ratio * ratio;
    rho[2] = -8 * ratio * ratio / (phi_ + s);
  }

 private:
  double phi_;
};

/// A Ceres problem over copies of a graph's poses.
class Problem {
 public:
  Problem(const GraphData& graph, const DcsLoss& closure_loss) : problem_(Ownership()) {
    for (const auto& [id, X_W] : graph.nodes) {
      blocks_[id] = ToBlock(X_W);
      problem_.AddParameterBlock(blocks_[id].data(), kPoseSize, &manifold_);
      if (graph.IsFixed(id)) problem_.SetParameterBlockConstant(blocks_[id].data());
    }
    for (const auto& [number, constraint] : graph.constraints) Add(constraint, closure_loss);
    for (const auto& [id, prior] : graph.priors)
      problem_.AddResidualBlock(new PriorCost(prior), nullptr, blocks_.at(id).data());
  }

  ceres::Problem& problem() { return problem_; }
  const std::map<NodeId, PoseBlock>& blocks() const { return blocks_; }

 private:
  void Add(const Constraint& constraint, const DcsLoss& closure_loss) {
    const bool is_doubted =
        constraint.kind != ConstraintKind::kOdometry && std::isfinite(closure_loss.phi);
    problem_.AddResidualBlock(new ConstraintCost(constraint),
                              is_doubted ? new DcsLossFunction(closure_loss.phi) : nullptr,
                              blocks_.at(constraint.from).data(), blocks_.at(constraint.to).data());
  }
  static ceres::Problem::Options Ownership() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  ceres::AutoDiffManifold<RightPerturbation, kPoseSize, kTangentSize> manifold_;
  std::map<NodeId, PoseBlock> blocks_;
  ceres::Problem problem_;
};

/// CHOLMOD asks for four threads at each of its many small steps, whatever the environment says: on
/// one it is three times as fast.
void KeepToOneThread() { omp_set_max_active_levels(0); }

// --- with a kept factor ---

/// Each step with a factor makes the error smaller by as much as its derivatives are right. Where
/// so many do not suffice, a new factor, which costs as much as some ten steps, pays.
constexpr int kStepsWithAFactor = 6;
/// A solve that needs more new factors than this is Ceres'.
constexpr int kNewFactors = 2;
/// Metres and radians: no pose is known so well.
constexpr double kNoStep = 1e-9;
/// A factorisation and the inverse's blocks cost as much as half a solve for this share of the
/// nodes.
constexpr double kFewPairs = 1.0 / 32;

}  // namespace

void PoseGraph::AddNode(NodeId id, const Pose3& X_W) {
  if (!graph_.nodes.emplace(id, X_W).second)
    throw std::invalid_argument("node " + std::to_string(id) + " is already in the graph");
  if (graph_.IsFixed(id)) factor_.reset();
}

void PoseGraph::SetPose(NodeId id, const Pose3& X_W) {
  graph_.nodes.at(id) = X_W;
  is_near_optimum_ = false;
}

void PoseGraph::Fix(NodeId id) {
  graph_.fixed.insert(id);
  factor_.reset();
}

void PoseGraph::SetPrior(NodeId id, const AbsolutePrior& prior) {
  graph_.priors[id] = prior;
  if (factor_ && factor_->Knows(id)) factor_.reset();
}

int PoseGraph::AddConstraint(const Constraint& constraint) {
  if (!graph_.nodes.count(constraint.from) || !graph_.nodes.count(constraint.to))
    throw std::invalid_argument("a constraint needs both its nodes in the graph");
  graph_.constraints.emplace(next_constraint_, constraint);
  return next_constraint_++;
}

void PoseGraph::RemoveConstraint(int number) {
  const auto constraint = graph_.constraints.find(number);
  if (constraint == graph_.constraints.end()) return;
  if (factor_) factor_->Remove(number, constraint->second);
  graph_.constraints.erase(constraint);
}

SolveSummary PoseGraph::Solve(DcsLoss closure_loss) {
  if (graph_.nodes.empty()) return {true, 0, 0, 0};
  const bool is_plain = !std::isfinite(closure_loss.phi);
  if (is_plain && is_near_optimum_)
    if (const auto summary = SolveNearby()) return *summary;
  const SolveSummary summary = SolveFromAnywhere(closure_loss);
  is_near_optimum_ = is_plain && summary.usable;
  return summary;
}

SolveSummary PoseGraph::SolveFromAnywhere(const DcsLoss& closure_loss) {
  Problem problem(graph_, closure_loss);
  KeepToOneThread();
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type =
      graph_.nodes.size() > kLarge ? ceres::SUITE_SPARSE : ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = options_.max_iterations;
  options.function_tolerance = options_.function_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.problem(), &summary);
  SolveSummary result{summary.IsSolutionUsable(), 2 * summary.initial_cost, 2 * summary.final_cost,
                      static_cast<int>(summary.iterations.size())};
  if (result.usable) {
    for (const auto& [id, block] : problem.blocks())
      if (!IsFixed(id)) graph_.nodes[id] = FromBlock(block.data());
  }
  return result;
}

/// Gauss-Newton with the kept factor. A step promises to lower the cost by g^T H^-1 g; the last one
/// is that which promises less than the tolerance.
std::optional<SolveSummary> PoseGraph::SolveNearby() {
  const std::map<NodeId, Pose3> start = graph_.nodes;
  SolveSummary summary{true, 0, 0, 0};
  bool has_factor = KeepFactor();
  for (int factor = 0; has_factor && factor <= kNewFactors; ++factor) {
    if (StepWithFactor(summary)) return summary;
    factor_ = KeptFactor::Of(graph_);
    has_factor = factor_.has_value();
  }
  for (auto& [id, X_W] : graph_.nodes) X_W = start.at(id);
  return std::nullopt;
}

bool PoseGraph::StepWithFactor(SolveSummary& summary) {
  const NormalEquations equations(graph_, factor_->rows());
  std::vector<Pose3*> nodes;
  for (const NodeId id : factor_->rows().ids()) nodes.push_back(&graph_.nodes.at(id));
  std::vector<Pose3> X_W(nodes.size());
  NormalEquations::Right now = equations.Evaluate();
  if (summary.iterations == 0) summary.initial_cost = now.cost;
  for (int i = 0; i < kStepsWithAFactor && summary.iterations < options_.max_iterations; ++i) {
    for (std::size_t row = 0; row < nodes.size(); ++row) X_W[row] = *nodes[row];
    const Eigen::VectorXd step = -factor_->Solve(now.gradient, X_W);
    const double promise = -step.dot(now.gradient);
    const bool is_last = promise <= options_.function_tolerance * now.cost ||
                         step.lpNorm<Eigen::Infinity>() < kNoStep;
    for (std::size_t row = 0; row < nodes.size(); ++row)
      *nodes[row] = Perturbed(X_W[row], step.segment<6>(6 * static_cast<Eigen::Index>(row)));
    NormalEquations::Right then = equations.Evaluate();
    ++summary.iterations;
    const bool is_lower = then.cost <= now.cost;
    if (is_lower) {
      now = std::move(then);
    } else {
      for (std::size_t row = 0; row < nodes.size(); ++row) *nodes[row] = X_W[row];
    }
    summary.final_cost = now.cost;
    if (is_last || !is_lower) return is_last;
  }
  return false;
}

bool PoseGraph::KeepFactor() const {
  if (factor_ && factor_->Follow(graph_)) return true;
  factor_ = KeptFactor::Of(graph_);
  return factor_.has_value();
}

double PoseGraph::Cost() const {
  return graph_.nodes.empty() ? 0 : NormalEquations(graph_, NodeRows(graph_)).Evaluate().cost;
}

double PoseGraph::ChiSquareOf(const Constraint& constraint) const {
  const RelativeError e = ErrorOf(constraint, X_W(constraint.from), X_W(constraint.to));
  return (constraint.whitening * e.error).squaredNorm();
}

bool PoseGraph::AreMany(const std::vector<NodePair>& pairs) const {
  std::set<NodeId> columns;
  for (const auto& [i, k] : pairs)
    if (i != k && !IsFixed(i) && !IsFixed(k)) columns.insert(k);
  const double inverse =
      factor_->HasMarginals() ? 0 : kFewPairs * static_cast<double>(graph_.nodes.size());
  return static_cast<double>(pairs.size()) > inverse + 2.0 * static_cast<double>(columns.size());
}

std::vector<Mat6> PoseGraph::RelativeCovariances(const std::vector<NodePair>& pairs) const {
  return KeepExactFactor() ? CovariancesByFactor(pairs) : std::vector<Mat6>{};
}

std::vector<Mat6> PoseGraph::RoughRelativeCovariances(const std::vector<NodePair>& pairs) const {
  return KeepNearFactor() ? CovariancesByFactor(pairs) : std::vector<Mat6>{};
}

bool PoseGraph::KeepExactFactor() const {
  if (!KeepFactor()) return false;
  if (!factor_->IsExactFor(graph_)) factor_ = KeptFactor::Of(graph_);
  return factor_.has_value();
}

bool PoseGraph::KeepNearFactor() const {
  if (!KeepFactor()) return false;
  if (!factor_->IsNear(graph_)) factor_ = KeptFactor::Of(graph_);
  return factor_.has_value();
}

std::vector<Mat6> PoseGraph::CovariancesByFactor(const std::vector<NodePair>& pairs) const {
  std::vector<Mat6> covariances;
  if (AreMany(pairs)) {
    covariances = CovariancesByColumns(pairs);
  } else {
    for (const NodePair& pair : pairs)
      covariances.push_back(factor_->InverseOf(DerivativesOf(pair)));
  }
  for (std::size_t p = 0; p < covariances.size(); ++p) {
    const NodeId k = pairs[p].second;
    const Mat6 carry = AdjointOf(Ominus(X_W(k), factor_->PoseOf(k)));
    covariances[p] = carry * covariances[p] * carry.transpose();
  }
  return covariances;
}

/// X_ik Exp(xi) with xi = xi_k - Ad(X_ik^-1) xi_i.
Eigen::MatrixXd PoseGraph::DerivativesOf(const NodePair& pair) const {
  const auto& [i, k] = pair;
  const NodeRows& rows = factor_->rows();
  Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(6 * rows.size(), 6);
  const auto row_i = rows.Of(i), row_k = rows.Of(k);
  if (row_k) derivatives.middleRows<6>(6 * *row_k) += Mat6::Identity();
  if (row_i)
    derivatives.middleRows<6>(6 * *row_i) -=
        AdjointOf(Ominus(factor_->PoseOf(k), factor_->PoseOf(i))).transpose();
  return derivatives;
}

std::vector<Mat6> PoseGraph::CovariancesByColumns(const std::vector<NodePair>& pairs) const {
  if (!factor_->HasMarginals()) {
    if (!factor_->IsPlain()) factor_ = KeptFactor::Of(graph_);
    if (!factor_) return {};
    factor_->FindMarginals();
  }
  const NodeRows& rows = factor_->rows();
  const auto marginal = [&](NodeId id) -> Mat6 {
    const auto row = rows.Of(id);
    return row ? factor_->marginals()[static_cast<std::size_t>(*row)] : Mat6::Zero();
  };
  std::map<NodeId, Eigen::MatrixXd> columns;  // Of the inverse, six a node.
  const auto cross = [&](NodeId i, NodeId k) -> Mat6 {
    const auto row_i = rows.Of(i), row_k = rows.Of(k);
    if (!row_i || !row_k) return Mat6::Zero();
    Eigen::MatrixXd& solved = columns[k];
    if (solved.size() == 0) {
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(6 * rows.size(), 6);
      unit.middleRows<6>(6 * *row_k).setIdentity();
      solved = factor_->Solve(unit);
    }
    return solved.middleRows<6>(6 * *row_i);
  };
  std::vector<Mat6> covariances;
  for (const auto& [i, k] : pairs) {
    if (i == k) {
      covariances.push_back(Mat6::Zero());
      continue;
    }
    const Mat6 A = AdjointOf(Ominus(factor_->PoseOf(k), factor_->PoseOf(i)));
    const Mat6 P_ik = A * cross(i, k);
    covariances.push_back(marginal(k) + A * marginal(i) * A.transpose() - P_ik - P_ik.transpose());
  }
  return covariances;
}

std::vector<int> ClosuresOf(const PoseGraph& graph) {
  std::vector<int> numbers;
  for (const auto& [number, constraint] : graph.constraints())
    if (constraint.kind != ConstraintKind::kOdometry) numbers.push_back(number);
  return numbers;
}

}  // namespace vog
