#include "lib/registration/point_cloud.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

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

double RadiusOf(const std::vector<Vec3>& points) {
  constexpr double kLeast_m = 0.1;
  if (points.empty()) return kLeast_m;
  double squares = 0;
  for (const Vec3& p : points) squares += p.squaredNorm();
  return std::max(kLeast_m, std::sqrt(squares / static_cast<double>(points.size())));
}

}  // namespace

RegistrationCloud::RegistrationCloud(std::vector<Vec3> points, double normal_radius_m,
                                     const Vec3& seen_from)
    : points_(std::move(points)),
      radius_m_(RadiusOf(points_)),
      tree_(std::make_unique<KdTree>(points_)) {
  std::vector<std::size_t> neighbours;
  for (const Vec3& point : points_) {
    tree_->Within(point, normal_radius_m, neighbours);
    LocalPlane plane = PlaneOf(points_, neighbours);
    if (plane.normal.dot(seen_from - point) < 0) plane.normal = -plane.normal;
    planes_.push_back(plane);
  }
}

RegistrationCloud::RegistrationCloud(std::vector<Vec3> points, std::vector<LocalPlane> planes)
    : points_(std::move(points)),
      planes_(std::move(planes)),
      radius_m_(RadiusOf(points_)),
      tree_(std::make_unique<KdTree>(points_)) {}

}  // namespace vog
