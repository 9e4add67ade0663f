#pragma once

#include "lib/base/config.h"
#include "lib/geometry/pose.h"
#include "lib/registration/point_cloud.h"

namespace vog {

/// Which directions of a pose the registration may move.
enum class IcpFreedom {
  kPlanar,  ///< x, y and yaw: z, roll and pitch are measured better than any registration finds
            ///< them.
  kFull,    ///< All six.
};

struct IcpOptions {
  IcpFreedom freedom = IcpFreedom::kPlanar;
  double normal_radius_m = 0.3;
  double start_distance_m = 0.8;
  double end_distance_m = 0.25;
  int iterations = 30;
  int max_points = 800;
  double min_normal_cosine = 0.5;
  double degenerate_share = 0.02;
  double point_sigma_m = 0.04;
  double effective_points = 20;

  void Visit(OptionsVisitor& v) {
    v("freedom", freedom,
      Names<IcpFreedom>{{IcpFreedom::kPlanar, "planar"}, {IcpFreedom::kFull, "full"}},
      "move x, y and yaw only, or all six");
    v("normal_radius_m", normal_radius_m, Between(0.01, 10), "neighbourhood of a surface normal");
    v("start_distance_m", start_distance_m, Between(0.01, 20),
      "farthest correspondence in the first iteration");
    v("end_distance_m", end_distance_m, Between(0.01, 20), "and in the last");
    v("iterations", iterations, Between(1, 1000), "of one registration");
    v("max_points", max_points, Between(50, 1e6),
      "points of the source that are used, spread evenly over it");
    v("min_normal_cosine", min_normal_cosine, Between(-1, 1),
      "correspondences whose normals differ by more than this are dropped");
    v("degenerate_share", degenerate_share, Between(0, 1),
      "a direction is degenerate when its eigenvalue is a smaller share of the points");
    v("point_sigma_m", point_sigma_m, Between(0.001, 1),
      "the least noise of a point along its normal: sonar and voxels");
    v("effective_points", effective_points, Between(1, 1e6),
      "independent points in a registration at most: neighbouring voxels share their errors");
  }
};

/// A registration of a source cloud (frame k) to a target cloud (frame i).
struct IcpResult {
  bool usable = false;  ///< Enough correspondences, and at least one direction is determined.
  Pose3 X_ik = Pose3::Identity();
  /// Of X_ik from the points alone, right perturbation. Meaningful in the directions of `basis`
  /// only.
  Mat6 covariance = Mat6::Identity();
  /// The well-conditioned directions V_u as columns, in the free coordinates.
  Eigen::Matrix<double, 6, Eigen::Dynamic> basis;
  int degenerate_directions = 0;  ///< Of the free ones.
  double rmse_m = 0;              ///< Of the residuals along the normals.
  double overlap = 0;             ///< Share of the source's points with a correspondence.
  int correspondences = 0;
  int iterations = 0;
};

/// Point-to-plane ICP, coarse to fine, from `initial_X_ik`. Directions in which the clouds do not
/// hold each other keep their initial value (solution remapping of Zhang, Kaess and Singh 2016):
/// those where an eigenvalue of the Hessian is small. Rotations are scaled by the cloud's radius,
/// so that all eigenvalues have one unit and lie between 0 and the number of points.
IcpResult Register(const IcpOptions& options, const RegistrationCloud& target,
                   const RegistrationCloud& source, const Pose3& initial_X_ik);

}  // namespace vog
