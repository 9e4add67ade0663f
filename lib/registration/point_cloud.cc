#include "lib/registration/point_cloud.h"

#include <Eigen/Eigenvalues>

namespace vog {
namespace {

constexpr std::size_t kMinPlanePoints = 5;
// The largest spread of a plane's points across it, as a share of the smaller one along it.
constexpr double kMaxThickness = 0.5;
// The smaller spread along it, as a share of the larger one: less is a line.
constexpr double kMinWidth = 1e-6;

Vec3 NormalOf(const std::vector<Vec3>& points, const std::vector<std::size_t>& neighbours) {
  if (neighbours.size() < kMinPlanePoints) return Vec3::Zero();
  Vec3 mean = Vec3::Zero();
  for (const std::size_t index : neighbours) mean += points[index];
  mean /= static_cast<double>(neighbours.size());
  Mat3 scatter = Mat3::Zero();
  for (const std::size_t index : neighbours)
    scatter += (points[index] - mean) * (points[index] - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(scatter);
  const Vec3 spread = solver.eigenvalues();
  if (spread[0] > kMaxThickness * spread[1] || spread[1] <= kMinWidth * spread[2])
    return Vec3::Zero();
  return solver.eigenvectors().col(0);
}

}  // namespace

RegistrationCloud::RegistrationCloud(std::vector<Vec3> points, double normal_radius_m,
                                     const Vec3& seen_from)
    : points_(std::move(points)), tree_(std::make_unique<KdTree>(points_)) {
  std::vector<std::size_t> neighbours;
  for (const Vec3& point : points_) {
    tree_->Within(point, normal_radius_m, neighbours);
    const Vec3 normal = NormalOf(points_, neighbours);
    normals_.push_back(normal.dot(seen_from - point) < 0 ? Vec3(-normal) : normal);
  }
}

}  // namespace vog
