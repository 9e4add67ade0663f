#pragma once

#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// How far a cloud lies from the true one.
struct CloudError {
  double rmse_m = 0;                        ///< Root mean square of nearest-neighbour distances.
  Pose3 X_truth_cloud = Pose3::Identity();  ///< The alignment.
  std::vector<float> distance_m;            ///< Of each point after the alignment.
};

/// Registers `cloud` to `truth` by rigid point-to-point ICP from the identity, without trimming,
/// and measures what is left. Large clouds are registered by an even share of their points; all are
/// measured.
/// @pre both have points.
CloudError MeasureCloud(const std::vector<Vec3>& cloud, const std::vector<Vec3>& truth);

/// The rigid motion that maps `from` onto `to` best in the least squares (Umeyama 1991, without
/// scale).
/// @pre equal sizes, at least one point.
Pose3 AlignPoints(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

/// One point for each occupied cell of a grid: the first that falls into it.
std::vector<Vec3> Downsample(const std::vector<Vec3>& points, double cell_m);

}  // namespace vog
