#include "lib/registration/icp.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

namespace vog {
namespace {

constexpr int kMinCorrespondences = 20;
constexpr double kConverged = 1e-5;  // Metres, or radians times the cloud's radius.

/// The free coordinates of a pose as columns of a 6 x n matrix.
Eigen::Matrix<double, 6, Eigen::Dynamic> FreeBasis(IcpFreedom freedom) {
  if (freedom == IcpFreedom::kFull) return Mat6::Identity();
  Eigen::Matrix<double, 6, Eigen::Dynamic> basis(6, 3);
  basis.setZero();
  basis(0, 0) = basis(1, 1) = basis(5, 2) = 1;
  return basis;
}

double RadiusOf(const std::vector<Vec3>& points) {
  double squares = 0;
  for (const Vec3& p : points) squares += p.squaredNorm();
  return std::max(0.1, std::sqrt(squares / static_cast<double>(points.size())));
}

std::size_t UsedPoints(const IcpOptions& options, const RegistrationCloud& source) {
  return std::min(source.size(), static_cast<std::size_t>(options.max_points));
}

/// The normal equations of one linearisation, in coordinates whose rotations are scaled to metres.
struct Linearisation {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
  double squares = 0;
  double weights = 0;
  int correspondences = 0;
};

Linearisation Linearise(const IcpOptions& options, const RegistrationCloud& target,
                        const RegistrationCloud& source, const Pose3& X_ik, double max_distance_m,
                        double radius_m) {
  Linearisation sum;
  const Mat3 R_ik = X_ik.linear();
  // Beyond this a residual counts linearly (Huber).
  const double linear_from_m = 0.5 * max_distance_m;
  const std::size_t used = UsedPoints(options, source);
  for (std::size_t u = 0; u < used; ++u) {
    const std::size_t s = u * source.size() / used;
    const Vec3 p_i = X_ik * source.points()[s];
    const auto nearest = target.NearestTo(p_i);
    const Vec3& normal_i = target.normals()[nearest.index];
    if (nearest.distance_m > max_distance_m || normal_i.isZero()) continue;
    const Vec3& normal_k = source.normals()[s];
    if (!normal_k.isZero() && normal_i.dot(R_ik * normal_k) < options.min_normal_cosine) continue;
    const double residual_m = normal_i.dot(p_i - target.points()[nearest.index]);
    const double weight = std::min(1.0, linear_from_m / std::max(std::abs(residual_m), 1e-9));
    // d residual / d xi for X_ik * Exp(xi).
    const Vec3 normal_in_k = R_ik.transpose() * normal_i;
    Vec6 J;
    J << normal_in_k, source.points()[s].cross(normal_in_k) / radius_m;
    sum.H += weight * J * J.transpose();
    sum.b -= weight * residual_m * J;
    sum.squares += weight * residual_m * residual_m;
    sum.weights += weight;
    ++sum.correspondences;
  }
  return sum;
}

/// The free directions split by how well the points hold them.
struct Directions {
  Eigen::MatrixXd vectors;      // Well-conditioned ones as columns, in free coordinates.
  Eigen::VectorXd eigenvalues;  // Theirs.
  int degenerate = 0;
};

Directions WellConditioned(const Eigen::MatrixXd& H_free, double smallest) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(H_free);
  Directions directions;
  while (directions.degenerate < H_free.rows() &&
         solver.eigenvalues()[directions.degenerate] < smallest)
    ++directions.degenerate;
  const Eigen::Index kept = H_free.rows() - directions.degenerate;
  directions.vectors = solver.eigenvectors().rightCols(kept);
  directions.eigenvalues = solver.eigenvalues().tail(kept);
  return directions;
}

}  // namespace

IcpResult Register(const IcpOptions& options, const RegistrationCloud& target,
                   const RegistrationCloud& source, const Pose3& initial_X_ik) {
  IcpResult result;
  result.X_ik = initial_X_ik;
  if (target.size() < kMinCorrespondences || source.size() < kMinCorrespondences) return result;
  const double radius_m = RadiusOf(source.points());
  const Eigen::Matrix<double, 6, Eigen::Dynamic> free = FreeBasis(options.freedom);
  Vec6 unscale = Vec6::Ones();
  unscale.tail<3>() /= radius_m;

  Linearisation at;
  Directions directions;
  const double shrink = std::pow(options.end_distance_m / options.start_distance_m,
                                 1.0 / std::max(1, options.iterations / 2));
  double distance_m = options.start_distance_m;
  for (result.iterations = 1; result.iterations <= options.iterations; ++result.iterations) {
    at = Linearise(options, target, source, result.X_ik, distance_m, radius_m);
    if (at.correspondences < kMinCorrespondences) return result;
    directions =
        WellConditioned(free.transpose() * at.H * free, options.degenerate_share * at.weights);
    if (directions.vectors.cols() == 0) return result;
    const Eigen::VectorXd step = directions.vectors *
                                 directions.eigenvalues.cwiseInverse().asDiagonal() *
                                 directions.vectors.transpose() * (free.transpose() * at.b);
    result.X_ik = result.X_ik * Exp(unscale.asDiagonal() * (free * step));
    const bool is_fine = distance_m <= options.end_distance_m;
    if (is_fine && step.norm() < kConverged) break;
    distance_m = std::max(options.end_distance_m, distance_m * shrink);
  }

  result.usable = true;
  result.correspondences = at.correspondences;
  result.overlap = at.correspondences / static_cast<double>(UsedPoints(options, source));
  result.rmse_m = std::sqrt(at.squares / at.weights);
  result.degenerate_directions = directions.degenerate;
  const double sigma_m = std::max(options.point_sigma_m, result.rmse_m);
  const double effective = std::min(1.0, options.effective_points / at.weights);
  // Directions in which nothing is known get the variance of something unknowable.
  constexpr double kUnknowable = 1e6;
  const Eigen::MatrixXd V = free * directions.vectors;
  const Mat6 known =
      V * (sigma_m * sigma_m / effective * directions.eigenvalues.cwiseInverse()).asDiagonal() *
      V.transpose();
  const Mat6 unknown = kUnknowable * (Mat6::Identity() - V * V.transpose());
  result.covariance = unscale.asDiagonal() * (known + unknown) * unscale.asDiagonal();
  // In unscaled coordinates the directions are no longer orthogonal; a QR makes them so again.
  const Eigen::MatrixXd rescaled = unscale.cwiseInverse().asDiagonal() * V;
  result.basis = Eigen::HouseholderQR<Eigen::MatrixXd>(rescaled).householderQ() *
                 Eigen::MatrixXd::Identity(6, V.cols());
  return result;
}

}  // namespace vog
