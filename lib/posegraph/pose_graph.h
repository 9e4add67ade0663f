#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lib/base/config.h"
#include "lib/geometry/pose.h"

namespace vog {

using NodeId = int;

/// Rows that whiten a six-dimensional residual; a partial constraint has fewer than six.
using Whitening = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6>;

enum class ConstraintKind { kOdometry, kFullClosure, kPartialClosure };

/// A measured relative pose of two nodes. Its residual is
///
///   W * Log(X_ik^-1 * X_Wi^-1 * X_Wk)
///
/// in the right perturbation of X_ik, order (x, y, z, roll, pitch, yaw), with W^T W the
/// information.
struct Constraint {
  NodeId from = 0, to = 0;  ///< i and k.
  ConstraintKind kind = ConstraintKind::kOdometry;
  Pose3 X_ik = Pose3::Identity();
  Whitening whitening;

  Mat6 Information() const { return whitening.transpose() * whitening; }
};

/// W with W^T W = covariance^-1. @pre positive definite.
Whitening WhiteningOf(const Mat6& covariance);
/// The same for the directions that are the columns of `basis` (6 x n) alone, eq. 6's third term:
/// residual V_u^T e with covariance V_u^T Sigma V_u.
Whitening PartialWhiteningOf(const Eigen::Matrix<double, 6, Eigen::Dynamic>& basis,
                             const Mat6& covariance);

/// z, roll and pitch of a node, which depth and attitude sensors measure absolutely.
struct AbsolutePrior {
  double z_m = 0, roll_rad = 0, pitch_rad = 0;
  double sigma_z_m = 1, sigma_angle_rad = 1;
};

struct PoseGraphOptions {
  int max_iterations = 30;
  double function_tolerance = 1e-8;

  void Visit(OptionsVisitor& v) {
    v("max_iterations", max_iterations, Between(1, 10000), "of the solver, a solve");
    v("function_tolerance", function_tolerance, Between(1e-16, 1e-1),
      "stop when the cost falls by a smaller share");
  }
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
  void SetPrior(NodeId id, const AbsolutePrior& prior) { priors_[id] = prior; }
  /// @pre both nodes are there. Returns the constraint's number.
  int AddConstraint(const Constraint& constraint);
  /// Its number is not used again.
  void RemoveConstraint(int number) { constraints_.erase(number); }

  SolveSummary Solve();

  /// Squared whitened residual of a constraint at the present poses: chi-square with as many
  /// degrees of freedom as its whitening has rows.
  double ChiSquareOf(const Constraint& constraint) const;

  /// Covariance of X_ik = X_Wi^-1 * X_Wk for each pair (i, k), right perturbation. One
  /// factorisation and six solves a node. Empty when the graph does not determine all poses.
  std::vector<Mat6> RelativeCovariances(const std::vector<std::pair<NodeId, NodeId>>& pairs) const;

  const Pose3& X_W(NodeId id) const { return nodes_.at(id); }
  const std::map<NodeId, Pose3>& nodes() const { return nodes_; }
  const std::map<int, Constraint>& constraints() const { return constraints_; }

 private:
  PoseGraphOptions options_;
  std::map<NodeId, Pose3> nodes_;
  std::map<NodeId, AbsolutePrior> priors_;
  std::map<int, Constraint> constraints_;
  int next_constraint_ = 0;
};

}  // namespace vog
