#include "lib/evaluation/cloud_error.h"

#include <Eigen/SVD>
#include <cmath>
#include <unordered_set>

#include "lib/base/parallel.h"
#include "lib/geometry/voxel_grid.h"
#include "lib/registration/kd_tree.h"

namespace vog {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kConverged = 1e-5;  // Metres and radians.
constexpr std::size_t kMaxIcpPoints = 20000;

std::vector<Vec3> EvenShare(const std::vector<Vec3>& points, std::size_t count) {
  if (points.size() <= count) return points;
  std::vector<Vec3> share;
  for (std::size_t i = 0; i < count; ++i) share.push_back(points[i * points.size() / count]);
  return share;
}

/// Calls `body(i)` for i < count in a few large pieces.
void ParallelPoints(std::size_t count, const std::function<void(std::size_t)>& body) {
  constexpr std::size_t kPiece = 4096;
  ParallelFor((count + kPiece - 1) / kPiece, [&](std::size_t piece) {
    for (std::size_t i = piece * kPiece; i < std::min(count, (piece + 1) * kPiece); ++i) body(i);
  });
}

}  // namespace

Pose3 AlignPoints(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  const double count = static_cast<double>(from.size());
  Vec3 mean_from = Vec3::Zero(), mean_to = Vec3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    mean_from += from[i] / count;
    mean_to += to[i] / count;
  }
  Mat3 cross = Mat3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    cross += (to[i] - mean_to) * (from[i] - mean_from).transpose();
  const Eigen::JacobiSVD<Mat3> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 signs = Vec3::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  Pose3 X = Pose3::Identity();
  X.linear() = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  X.translation() = mean_to - X.linear() * mean_from;
  return X;
}

CloudError MeasureCloud(const std::vector<Vec3>& cloud, const std::vector<Vec3>& truth) {
  const KdTree tree(truth);
  const std::vector<Vec3> share = EvenShare(cloud, kMaxIcpPoints);
  std::vector<Vec3> partners(share.size());
  CloudError error;
  for (int i = 0; i < kMaxIterations; ++i) {
    ParallelPoints(share.size(), [&](std::size_t p) {
      partners[p] = truth[tree.NearestTo(error.X_truth_cloud * share[p]).index];
    });
    const Pose3 X_next = AlignPoints(share, partners);
    const double moved = Log(Ominus(error.X_truth_cloud, X_next)).norm();
    error.X_truth_cloud = X_next;
    if (moved < kConverged) break;
  }
  error.distance_m.resize(cloud.size());
  ParallelPoints(cloud.size(), [&](std::size_t p) {
    error.distance_m[p] =
        static_cast<float>(tree.NearestTo(error.X_truth_cloud * cloud[p]).distance_m);
  });
  double squares = 0;
  for (const double distance_m : error.distance_m) squares += distance_m * distance_m;
  error.rmse_m = std::sqrt(squares / static_cast<double>(cloud.size()));
  return error;
}

std::vector<Vec3> Downsample(const std::vector<Vec3>& points, double cell_m) {
  const VoxelGrid cells(cell_m);
  std::unordered_set<VoxelKey> taken;
  std::vector<Vec3> kept;
  for (const Vec3& point : points) {
    if (taken.insert(cells.KeyOf(point)).second) kept.push_back(point);
  }
  return kept;
}

}  // namespace vog
