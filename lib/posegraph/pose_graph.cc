#include "lib/posegraph/pose_graph.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <array>
#include <memory>
#include <set>
#include <stdexcept>

namespace vog {
namespace {

/// x, y, z, qx, qy, qz, qw.
using PoseBlock = std::array<double, 7>;
constexpr int kPoseSize = 7, kTangentSize = 6;

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

/// A Ceres problem over copies of a graph's poses.
class Problem {
 public:
  Problem(const std::map<NodeId, Pose3>& nodes, const std::map<int, Constraint>& constraints,
          const std::map<NodeId, AbsolutePrior>& priors)
      : problem_(Ownership()) {
    for (const auto& [id, X_W] : nodes) {
      blocks_[id] = ToBlock(X_W);
      problem_.AddParameterBlock(blocks_[id].data(), kPoseSize, &manifold_);
    }
    for (const auto& [number, constraint] : constraints)
      problem_.AddResidualBlock(MakeCost(constraint), nullptr, blocks_.at(constraint.from).data(),
                                blocks_.at(constraint.to).data());
    for (const auto& [id, prior] : priors)
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<AbsoluteError, 3, kPoseSize>(new AbsoluteError(prior)),
          nullptr, blocks_.at(id).data());
    if (!blocks_.empty()) problem_.SetParameterBlockConstant(blocks_.begin()->second.data());
  }

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

}  // namespace

Whitening WhiteningOf(const Mat6& covariance) {
  return PartialWhiteningOf(Mat6::Identity(), covariance);
}

Whitening PartialWhiteningOf(const Eigen::Matrix<double, 6, Eigen::Dynamic>& basis,
                             const Mat6& covariance) {
  const Eigen::MatrixXd projected = basis.transpose() * covariance * basis;
  const Eigen::LLT<Eigen::MatrixXd> llt(projected);
  if (llt.info() != Eigen::Success)
    throw std::invalid_argument("the covariance of a constraint is not positive definite");
  return llt.matrixL().solve(Eigen::MatrixXd(basis.transpose()));
}

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

SolveSummary PoseGraph::Solve() {
  Problem problem(nodes_, constraints_, priors_);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Without BLAS the result does not depend on which BLAS a machine has, nor on its threads.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = options_.max_iterations;
  options.function_tolerance = options_.function_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.problem(), &summary);
  SolveSummary result{summary.IsSolutionUsable(), 2 * summary.initial_cost, 2 * summary.final_cost,
                      static_cast<int>(summary.iterations.size())};
  if (result.usable) {
    for (const auto& [id, block] : problem.blocks()) nodes_[id] = FromBlock(block);
  }
  return result;
}

double PoseGraph::ChiSquareOf(const Constraint& constraint) const {
  const PoseBlock i = ToBlock(X_W(constraint.from)), k = ToBlock(X_W(constraint.to));
  const RelativePoseError error(constraint.X_ik, constraint.whitening);
  return (constraint.whitening * error.Error(i.data(), k.data())).squaredNorm();
}

std::vector<Mat6> PoseGraph::RelativeCovariances(
    const std::vector<std::pair<NodeId, NodeId>>& pairs) const {
  if (nodes_.size() < 2) return std::vector<Mat6>(pairs.size(), Mat6::Zero());  // All fixed.
  Problem problem(nodes_, constraints_, priors_);
  // Order of the columns: the free nodes by number. The first node is fixed and has none.
  std::map<NodeId, int> column;
  ceres::Problem::EvaluateOptions order;
  for (auto& [id, block] : problem.blocks()) {
    const bool is_fixed = id == problem.blocks().begin()->first;
    column[id] = is_fixed ? -1 : kTangentSize * static_cast<int>(order.parameter_blocks.size());
    if (!is_fixed) order.parameter_blocks.push_back(block.data());
  }
  ceres::CRSMatrix crs;
  problem.problem().Evaluate(order, nullptr, nullptr, nullptr, &crs);
  const SparseMatrix J = ToEigen(crs);
  const Eigen::SimplicialLDLT<SparseMatrix> factor(SparseMatrix(J.transpose() * J));
  if (factor.info() != Eigen::Success || (factor.vectorD().array() <= 0).any()) return {};

  std::map<NodeId, Eigen::MatrixXd> columns;  // Of the inverse, six a node.
  const auto block = [&](NodeId row, NodeId col) -> Mat6 {
    if (column.at(row) < 0 || column.at(col) < 0) return Mat6::Zero();
    auto& solved = columns[col];
    if (solved.size() == 0) {
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(J.cols(), kTangentSize);
      unit.middleRows<kTangentSize>(column.at(col)).setIdentity();
      solved = factor.solve(unit);
    }
    return solved.middleRows<kTangentSize>(column.at(row));
  };
  std::vector<Mat6> covariances;
  for (const auto& [i, k] : pairs) {
    // X_ik Exp(xi) with xi = xi_k - Ad(X_ik^-1) xi_i.
    const Mat6 A = AdjointOf(Ominus(X_W(k), X_W(i)));
    const Mat6 cross = A * block(i, k);
    covariances.push_back(block(k, k) + A * block(i, i) * A.transpose() - cross -
                          cross.transpose());
  }
  return covariances;
}

}  // namespace vog
