#include "lib/registration/point_cloud.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace vog {
namespace {

constexpr std::size_t kMinPlanePoints = 5;
// The largest spread of a plane's points across it, as a share of the smaller one along it.
constexpr double kMaxThickness = 0.5;
// The smaller spread along it, as a share of the larger one: less is a line.
constexpr double kMinWidth = 1e-6;

LocalPlane PlaneOf(const std::vector<Vec3>& points, const std::vector<std::size_t>& neighbours) {
  if (neighbours.size() < kMinPlanePoints) return {};
  const auto count = static_cast<double>(neighbours.size());
  Vec3 mean = Vec3::Zero();
  for (const std::size_t index : neighbours) mean += points[index];
  mean /= count;
  Mat3 scatter = Mat3::Zero();
  for (const std::size_t index : neighbours)
    scatter += (points[index] - mean) * (points[index] - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(scatter);
  const Vec3 spread = solver.eigenvalues();
  if (spread[0] > kMaxThickness * spread[1] || spread[1] <= kMinWidth * spread[2]) return {};
  constexpr int kPlaneParameters = 3;
  return {solver.eigenvectors().col(0), std::max(0.0, spread[0]) / (count - kPlaneParameters),
          spread[1]};
}

}  // namespace

RegistrationCloud::RegistrationCloud(std::vector<Vec3> points, double normal_radius_m,
                                     const Vec3& seen_from)
    : points_(std::move(points)), tree_(std::make_unique<KdTree>(points_)) {
  std::vector<std::size_t> neighbours;
  for (const Vec3& point : points_) {
    tree_->Within(point, normal_radius_m, neighbours);
    LocalPlane plane = PlaneOf(points_, neighbours);
    if (plane.normal.dot(seen_from - point) < 0) plane.normal = -plane.normal;
    planes_.push_back(plane);
  }
}

}  // namespace vog
