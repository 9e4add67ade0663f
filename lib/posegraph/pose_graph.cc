#include "lib/posegraph/pose_graph.h"

#include <ceres/ceres.h>
#include <omp.h>

#include <Eigen/SparseCore>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "lib/posegraph/block_cholesky.h"

namespace vog {
namespace {

/// x, y, z, qx, qy, qz, qw.
using PoseBlock = std::array<double, 7>;
constexpr int kPoseSize = 7, kTangentSize = 6;
/// Graphs with more nodes than this are factored by CHOLMOD, whose dense parts BLAS computes.
/// Smaller ones need no BLAS: what a mission computes does not depend on which one a machine has.
constexpr std::size_t kLarge = 1000;
/// Pivots below this share of their diagonal entry are rounding errors: a pose is free.
constexpr double kSingularPivot = 1e-14;

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

Pose3 FromBlock(const PoseBlock& block) {
  return MakePose(Vec3(block[0], block[1], block[2]),
                  Eigen::Quaterniond(block[6], block[3], block[4], block[5]));
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

/// The residual of a Constraint. To first order in the error it is Log(), whose translation part is
/// taken without the rotation's Jacobian.
struct RelativePoseError {
  RelativePoseError(const Pose3& X_ik, const Whitening& whitening)
      : q_ik(X_ik.linear()), p_ik(X_ik.translation()), whitening(whitening) {}

  template <class T>
  Eigen::Matrix<T, 6, 1> Error(const T* i, const T* k) const {
    const QuaternionMap<T> q_Wi(i + 3), q_Wk(k + 3);
    const Eigen::Matrix<T, 3, 1> p_ik_now =
        q_Wi.conjugate() * Eigen::Matrix<T, 3, 1>(VectorMap<T>(k) - VectorMap<T>(i));
    const Eigen::Quaternion<T> q_ki = q_ik.conjugate().template cast<T>();
    Eigen::Quaternion<T> q_error = q_ki * (q_Wi.conjugate() * q_Wk);
    if (q_error.w() < T(0)) q_error.coeffs() = -q_error.coeffs();
    Eigen::Matrix<T, 6, 1> error;
    error.template head<3>() = q_ki * Eigen::Matrix<T, 3, 1>(p_ik_now - p_ik.template cast<T>());
    error.template tail<3>() = T(2) * q_error.vec();
    return error;
  }

  template <class T>
  bool operator()(const T* i, const T* k, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 1>> whitened(residual, whitening.rows());
    whitened = whitening.template cast<T>() * Error(i, k);
    return true;
  }

  Eigen::Quaterniond q_ik;
  Vec3 p_ik;
  Whitening whitening;
};

/// The residual of an AbsolutePrior: height, and the tilt of the vertical seen from the body.
struct AbsoluteError {
  explicit AbsoluteError(const AbsolutePrior& prior)
      : prior(prior),
        up_B(MakePose(Vec3::Zero(), {prior.roll_rad, prior.pitch_rad, 0}).linear().transpose() *
             Vec3::UnitZ()) {}

  template <class T>
  bool operator()(const T* pose, T* residual) const {
    const QuaternionMap<T> q_WB(pose + 3);
    const Eigen::Matrix<T, 3, 1> up = q_WB.conjugate() * Eigen::Matrix<T, 3, 1>(T(0), T(0), T(1));
    const Eigen::Matrix<T, 3, 1> tilt = up_B.cast<T>().cross(up);
    residual[0] = (pose[2] - prior.z_m) / prior.sigma_z_m;
    residual[1] = tilt[0] / prior.sigma_angle_rad;
    residual[2] = tilt[1] / prior.sigma_angle_rad;
    return true;
  }

  AbsolutePrior prior;
  Vec3 up_B;
};

ceres::CostFunction* MakeCost(const Constraint& constraint) {
  using Cost = ceres::AutoDiffCostFunction<RelativePoseError, ceres::DYNAMIC, kPoseSize, kPoseSize>;
  return new Cost(new RelativePoseError(constraint.X_ik, constraint.whitening),
                  static_cast<int>(constraint.whitening.rows()));
}

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
  explicit Problem(const std::map<NodeId, Pose3>& nodes) : problem_(Ownership()) {
    for (const auto& [id, X_W] : nodes) {
      blocks_[id] = ToBlock(X_W);
      problem_.AddParameterBlock(blocks_[id].data(), kPoseSize, &manifold_);
    }
  }

  void Add(const Constraint& constraint, const DcsLoss& closure_loss) {
    const bool is_doubted =
        constraint.kind != ConstraintKind::kOdometry && std::isfinite(closure_loss.phi);
    problem_.AddResidualBlock(MakeCost(constraint),
                              is_doubted ? new DcsLossFunction(closure_loss.phi) : nullptr,
                              blocks_.at(constraint.from).data(), blocks_.at(constraint.to).data());
  }
  void Add(NodeId id, const AbsolutePrior& prior) {
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<AbsoluteError, 3, kPoseSize>(new AbsoluteError(prior)),
        nullptr, blocks_.at(id).data());
  }
  void Fix(NodeId id) { problem_.SetParameterBlockConstant(blocks_.at(id).data()); }

  ceres::Problem& problem() { return problem_; }
  std::map<NodeId, PoseBlock>& blocks() { return blocks_; }

 private:
  static ceres::Problem::Options Ownership() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  ceres::AutoDiffManifold<RightPerturbation, kPoseSize, kTangentSize> manifold_;
  std::map<NodeId, PoseBlock> blocks_;
  ceres::Problem problem_;
};

using SparseMatrix = Eigen::SparseMatrix<double>;

SparseMatrix ToEigen(const ceres::CRSMatrix& crs) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(crs.values.size());
  for (int row = 0; row < crs.num_rows; ++row)
    for (int i = crs.rows[row]; i < crs.rows[row + 1]; ++i)
      triplets.emplace_back(row, crs.cols[i], crs.values[i]);
  SparseMatrix matrix(crs.num_rows, crs.num_cols);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

std::unique_ptr<Problem> MakeProblem(const PoseGraph& graph,
                                     const std::map<NodeId, AbsolutePrior>& priors,
                                     const DcsLoss& closure_loss) {
  auto problem = std::make_unique<Problem>(graph.nodes());
  for (const auto& [number, constraint] : graph.constraints())
    problem->Add(constraint, closure_loss);
  for (const auto& [id, prior] : priors) problem->Add(id, prior);
  for (const auto& [id, X_W] : graph.nodes())
    if (graph.IsFixed(id)) problem->Fix(id);
  return problem;
}

/// CHOLMOD asks for four threads at each of its many small steps, whatever the environment says: on
/// one it is three times as fast.
void KeepToOneThread() { omp_set_max_active_levels(0); }

/// J^T J in blocks of a node each.
BlockMatrix<kTangentSize> BlocksOf(const SparseMatrix& H) {
  BlockMatrix<kTangentSize> blocks;
  blocks.diagonal.assign(static_cast<std::size_t>(H.cols() / kTangentSize), Mat6::Zero());
  std::map<std::pair<int, int>, std::size_t> places;
  for (int col = 0; col < H.outerSize(); ++col)
    for (SparseMatrix::InnerIterator entry(H, col); entry; ++entry) {
      const int i = static_cast<int>(entry.row()) / kTangentSize, k = col / kTangentSize;
      if (i > k) continue;
      Mat6* block = i == k ? &blocks.diagonal[static_cast<std::size_t>(i)] : nullptr;
      if (block == nullptr) {
        const auto [place, is_new] = places.emplace(std::pair(i, k), blocks.blocks.size());
        if (is_new) {
          blocks.places.push_back(place->first);
          blocks.blocks.push_back(Mat6::Zero());
        }
        block = &blocks.blocks[place->second];
      }
      (*block)(entry.row() % kTangentSize, col % kTangentSize) = entry.value();
    }
  return blocks;
}

}  // namespace

void PoseGraph::AddNode(NodeId id, const Pose3& X_W) {
  if (!nodes_.emplace(id, X_W).second)
    throw std::invalid_argument("node " + std::to_string(id) + " is already in the graph");
}

int PoseGraph::AddConstraint(const Constraint& constraint) {
  if (!nodes_.count(constraint.from) || !nodes_.count(constraint.to))
    throw std::invalid_argument("a constraint needs both its nodes in the graph");
  constraints_.emplace(next_constraint_, constraint);
  return next_constraint_++;
}

SolveSummary PoseGraph::Solve(DcsLoss closure_loss) {
  if (nodes_.empty()) return {true, 0, 0, 0};
  const auto problem = MakeProblem(*this, priors_, closure_loss);
  KeepToOneThread();
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type =
      nodes_.size() > kLarge ? ceres::SUITE_SPARSE : ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = options_.max_iterations;
  options.function_tolerance = options_.function_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem->problem(), &summary);
  SolveSummary result{summary.IsSolutionUsable(), 2 * summary.initial_cost, 2 * summary.final_cost,
                      static_cast<int>(summary.iterations.size())};
  if (result.usable) {
    for (const auto& [id, block] : problem->blocks())
      if (!IsFixed(id)) nodes_[id] = FromBlock(block);
  }
  return result;
}

double PoseGraph::Cost() const {
  if (nodes_.empty()) return 0;
  double half_cost = 0;
  MakeProblem(*this, priors_, {})->problem().Evaluate({}, &half_cost, nullptr, nullptr, nullptr);
  return 2 * half_cost;
}

double PoseGraph::ChiSquareOf(const Constraint& constraint) const {
  const PoseBlock i = ToBlock(X_W(constraint.from)), k = ToBlock(X_W(constraint.to));
  const RelativePoseError error(constraint.X_ik, constraint.whitening);
  return (constraint.whitening * error.Error(i.data(), k.data())).squaredNorm();
}

std::vector<Mat6> PoseGraph::RelativeCovariances(
    const std::vector<std::pair<NodeId, NodeId>>& pairs) const {
  std::map<NodeId, int> index;  // Of the free nodes.
  for (const auto& [id, X_W] : nodes_)
    if (!IsFixed(id)) index.emplace(id, static_cast<int>(index.size()));
  if (index.empty()) return std::vector<Mat6>(pairs.size(), Mat6::Zero());
  const auto problem = MakeProblem(*this, priors_, {});
  ceres::Problem::EvaluateOptions order;
  for (const auto& [id, i] : index) order.parameter_blocks.push_back(problem->blocks()[id].data());
  ceres::CRSMatrix crs;
  problem->problem().Evaluate(order, nullptr, nullptr, nullptr, &crs);
  const SparseMatrix J = ToEigen(crs);
  BlockCholesky<kTangentSize> factor;
  if (!factor.Factor(BlocksOf(J.transpose() * J)) || factor.SmallestPivot() < kSingularPivot)
    return {};

  const std::vector<Mat6> diagonal = factor.InverseDiagonal();
  std::map<NodeId, Eigen::MatrixXd> columns;  // Of the inverse, six a node.
  const auto marginal = [&](NodeId id) -> Mat6 {
    return IsFixed(id) ? Mat6::Zero() : diagonal[static_cast<std::size_t>(index.at(id))];
  };
  const auto cross = [&](NodeId row, NodeId column) -> Mat6 {
    if (IsFixed(row) || IsFixed(column)) return Mat6::Zero();
    Eigen::MatrixXd& solved = columns[column];
    if (solved.size() == 0) {
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(J.cols(), kTangentSize);
      unit.middleRows<kTangentSize>(kTangentSize * index.at(column)).setIdentity();
      solved = factor.Solve(unit);
    }
    return solved.middleRows<kTangentSize>(kTangentSize * index.at(row));
  };
  std::vector<Mat6> covariances;
  for (const auto& [i, k] : pairs) {
    if (i == k) {
      covariances.push_back(Mat6::Zero());
      continue;
    }
    // X_ik Exp(xi) with xi = xi_k - Ad(X_ik^-1) xi_i.
    const Mat6 A = AdjointOf(Ominus(X_W(k), X_W(i)));
    const Mat6 P_ik = A * cross(i, k);
    covariances.push_back(marginal(k) + A * marginal(i) * A.transpose() - P_ik - P_ik.transpose());
  }
  return covariances;
}

}  // namespace vog
