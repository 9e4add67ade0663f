#pragma once

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
/// W with W^T W = information and as many rows as it has rank. @pre positive semi-definite.
Whitening WhiteningOfInformation(const Mat6& information);

/// z, roll and pitch of a node, which depth and attitude sensors measure absolutely.
struct AbsolutePrior {
  double z_m = 0, roll_rad = 0, pitch_rad = 0;
  double sigma_z_m = 1, sigma_angle_rad = 1;
};

}  // namespace vog
