#pragma once

#include <limits>
#include <unordered_set>
#include <vector>

#include "lib/geometry/voxel_grid.h"
#include "lib/loopclosure/loop_closure_options.h"
#include "lib/registration/icp.h"
#include "lib/submap/submap.h"

namespace vog {

/// The frame C of a submap that the pose graph places: where its content on the average says that
/// the body was. All drifts are covariances of (x, y, yaw).
struct SubmapAnchor {
  Pose3 X_MC = Pose3::Identity();
  /// How far content that another submap shares lies from the average.
  Mat3 content_drift = Mat3::Zero();
  /// How far the body was from C: what drift has done to all content.
  Mat3 body_drift = Mat3::Zero();
  Mat3 drift_before = Mat3::Zero();  ///< Of the body's motion from the base to C.
};

/// Covariance of the body's relative pose X_ik, right perturbation, from that of two submaps'
/// frames C.
Mat6 BodyCovariance(const Mat6& covariance_of_frames, const Pose3& X_ik, const SubmapAnchor& i,
                    const SubmapAnchor& k);

/// Covariance in C of the turn that drift D feigns. Seen one after the other from side to side,
/// points that the drift displaced lie as if their cloud were turned: the slope of a random walk
/// over time has variance 6/5 D, and time sweeps over the cloud's width, the square root of 12
/// times its standard deviation r. That is D / 10 r^2, about the cloud's middle.
Mat3 FeignedTurn(const Mat3& drift, const std::vector<Vec3>& points_C);

/// A closed submap as the loop closer sees it.
struct SubmapShape {
  SubmapShape(const SubmapPtr& submap, const SubmapAnchor& anchor, LogOddsUnits occupied_from,
              const LoopClosureOptions& options, const IcpOptions& icp);

  /// Whether a point in C lies in an occupied cell.
  bool HasNear(const Vec3& p_C) const { return occupied_cells.count(cells.KeyOf(p_C)) != 0; }

  SubmapPtr submap;
  SubmapId id;
  SubmapAnchor anchor;
  LogOddsUnits occupied_from;
  RegistrationCloud cloud;  ///< Occupied voxels, in C.
  Mat3 content_drift;       ///< The anchor's, and how drift has turned the content.
  VoxelGrid cells;
  std::unordered_set<VoxelKey> occupied_cells;  ///< With a margin of one cell.
};

/// Which of `source`'s points lie in `target`'s cells.
std::vector<bool> PointsIn(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik);
/// Calls `use` with all points of a cloud, or `most` of them spread evenly over it; returns how
/// many.
template <class Use>
std::size_t ForSpreadPoints(const RegistrationCloud& cloud, std::size_t most, Use use) {
  const std::size_t used = std::min(most, cloud.size());
  for (std::size_t u = 0; u < used; ++u) use(cloud.points()[u * cloud.size() / used]);
  return used;
}

/// Share of `source`'s points, or of at most `most_points` spread evenly over them, that lie in
/// `target`'s cells.
double PredictOverlap(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik,
                      std::size_t most_points = std::numeric_limits<std::size_t>::max());

}  // namespace vog
