#pragma once

#include "lib/posegraph/constraint.h"

namespace vog {

/// A whitened residual of at most six rows.
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

/// The error of a constraint before whitening and its derivatives by Perturbed() of both nodes. To
/// first order in the error it is Log(), whose translation part is taken without the rotation's
/// Jacobian.
struct RelativeError {
  Vec6 error;
  Mat6 by_i, by_k;
};
RelativeError ErrorOf(const Constraint& constraint, const Pose3& X_Wi, const Pose3& X_Wk);

/// The residual of a prior, height and the tilt of the vertical seen from the body, and its
/// derivative by Perturbed() of the node.
struct AbsoluteError {
  Vec3 residual;
  Eigen::Matrix<double, 3, 6> by_pose;
};
AbsoluteError ErrorOf(const AbsolutePrior& prior, const Pose3& X_W);

/// X perturbed on the right by `xi` = (translation, rotation): X * Exp(xi) to first order.
Pose3 Perturbed(const Pose3& X, const Vec6& xi);

}  // namespace vog
