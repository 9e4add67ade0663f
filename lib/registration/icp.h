#pragma once

#include <vector>

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

/// How a registration tells the directions in which the clouds hold each other.
enum class Degeneracy {
  kNoise,  ///< Where the points hold more than the noise of their normals feigns.
  kShare,  ///< Zhang, Kaess and Singh 2016: where an eigenvalue exceeds a constant.
};

struct IcpOptions {
  IcpFreedom freedom = IcpFreedom::kPlanar;
  double normal_radius_m = 0.3;
  double start_distance_m = 0.8;
  double end_distance_m = 0.25;
  int iterations = 30;
  int max_points = 800;
  double min_normal_cosine = 0.5;
  Degeneracy degeneracy = Degeneracy::kNoise;
  double min_signal_to_noise = 2.5;
  double degenerate_share = 0.02;
  double point_sigma_m = 0.04;
  double correlation_m = 0.6;
  double least_shared_error_m = 0.012;

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
    v("degeneracy", degeneracy,
      Names<Degeneracy>{{Degeneracy::kNoise, "noise"}, {Degeneracy::kShare, "share"}},
      "a direction is degenerate when noise alone may feign what holds it, or by a constant");
    v("min_signal_to_noise", min_signal_to_noise, Between(1, 1e6),
      "noise: how often a direction must be held as firmly as by noisy normals alone");
    v("degenerate_share", degenerate_share, Between(0, 1),
      "share: a direction is degenerate when its eigenvalue is a smaller share of the points");
    v("point_sigma_m", point_sigma_m, Between(0.001, 1),
      "the least noise of a point along its normal: sonar and voxels");
    v("correlation_m", correlation_m, Between(0.01, 20), "points nearer than this share an error");
    v("least_shared_error_m", least_shared_error_m, Between(0, 1),
      "standard deviation of that, at least");
  }
};

/// A registration of a source cloud (frame k) to a target cloud (frame i).
struct IcpResult {
  /// Enough correspondences, at least one direction is determined, and it did not go astray along
  /// the others.
  bool usable = false;
  Pose3 X_ik = Pose3::Identity();
  /// Of X_ik from the points alone, right perturbation. Meaningful in the directions of `basis`
  /// only.
  Mat6 covariance = Mat6::Identity();
  /// The directions V_u of the error Log(X_ik^-1 X) that are measured, as orthonormal columns.
  Eigen::Matrix<double, 6, Eigen::Dynamic> basis;
  int degenerate_directions = 0;  ///< Of the free ones.
  /// Of each free direction, ascending: how firmly the points hold it, as a multiple of what noise
  /// alone would feign.
  std::vector<double> signal_to_noise;
  double rmse_m = 0;   ///< Of the residuals along the normals.
  double overlap = 0;  ///< Share of the source's points with a correspondence.
  int correspondences = 0;
  int iterations = 0;
};

/// The points that Register() is to be given of those seen from `seen_from`. Where only x, y and
/// yaw may move, those of surfaces as level as their noise can tell (99 %) are left out: a sea
/// floor holds no motion along itself, and the noise of its many normals would drown what a few
/// piles do hold. O(n log n).
RegistrationCloud CloudFor(const IcpOptions& options, std::vector<Vec3> points,
                           const Vec3& seen_from);

/// Point-to-plane ICP, coarse to fine, from `initial_X_ik`; while correspondences reach farther
/// than end_distance_m, with a quarter of the points. Directions in which the clouds do not hold
/// each other keep their initial value (solution remapping of Zhang, Kaess and Singh 2016). Where
/// far correspondences held at first what the last ones do not, and the way along it bends by more
/// than point_sigma_m, the result goes back along it to near the start and is refined from there: a
/// constraint that leaves a direction free is linear about its measured pose, and must not be
/// measured from the other side of a pillar. What leaves again and again is not usable.
///
/// Which those are is told from the noise of the normals. With J_n the row of a correspondence with
/// the normal n, H = sum J_n^T J_n would grow by N = sum v (J_t^T J_t + J_s^T J_s) if the normals
/// were tilted at random with variance v [rad^2], t and s being the directions across n; v follows
/// from the plane through the neighbours. Where u^T H u is not some times u^T N u, noise may be all
/// that is there. The directions u are the generalised eigenvectors H u = rho N u, which do not
/// depend on the units of translations and rotations. (The signal against the Hessian's own noise
/// after Hatleskog and Alexis 2024.)
///
/// The covariance follows from one shared error in each cell of `correlation_m`, voxels of one
/// patch of surface do not err independently, and a little of each point's own. It is positive
/// definite in the measured directions.
IcpResult Register(const IcpOptions& options, const RegistrationCloud& target,
                   const RegistrationCloud& source, const Pose3& initial_X_ik);

}  // namespace vog
