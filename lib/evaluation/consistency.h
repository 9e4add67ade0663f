#pragma once

#include <optional>
#include <vector>

#include "lib/evaluation/statistics.h"
#include "lib/geometry/pose.h"

namespace vog {

/// What an estimate of a planar pose (x, y, yaw) got wrong, and the covariance that it claims.
struct PlanarError {
  Vec3 error = Vec3::Zero();  ///< Perturbation on the body side [m, m, rad].
  Mat3 covariance = Mat3::Zero();
};

/// Whether errors are as large as their covariances say [Bar-Shalom et al. 2001, 5.4].
struct Consistency {
  /// Mean of e^T P^-1 e / 3: 1 where the covariances hold, more where they promise too much.
  double nees_per_dimension = 0;
  /// Share of e^T P^-1 e below the value that a chi-square variable of 3 degrees of freedom stays
  /// below in 95 % of all cases.
  double share_below_95 = 0;
};

/// e^T P^-1 e / 3 of each. Nothing when a covariance is not positive definite.
std::optional<std::vector<double>> NeesPerDimension(const std::vector<PlanarError>& errors);

/// Between which two e^T P^-1 e / 3 lies in 95 % of all cases, as often below as above.
Interval NeesBand95();

/// Nothing without errors, or when a covariance is not positive definite.
std::optional<Consistency> JudgeConsistency(const std::vector<PlanarError>& errors);

}  // namespace vog
