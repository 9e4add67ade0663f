#include "lib/loopclosure/submap_shape.h"

#include "lib/geometry/odometry.h"

namespace vog {
namespace {

std::unordered_set<VoxelKey> CellsAround(const VoxelGrid& cells, const std::vector<Vec3>& points) {
  std::unordered_set<VoxelKey> occupied;
  for (const Vec3& p : points) {
    const VoxelKey key = cells.KeyOf(p);
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) occupied.insert({key.x + dx, key.y + dy, key.z + dz});
  }
  return occupied;
}

std::vector<Vec3> Transformed(const Pose3& X, std::vector<Vec3> points) {
  for (Vec3& p : points) p = X * p;
  return points;
}

}  // namespace

Mat6 BodyCovariance(const Mat6& covariance_of_frames, const Pose3& X_ik, const SubmapAnchor& i,
                    const SubmapAnchor& k) {
  const Mat6 Ad_ki = AdjointOf(X_ik.inverse());
  return covariance_of_frames + Ad_ki * PlanarTo6(i.body_drift) * Ad_ki.transpose() +
         PlanarTo6(k.body_drift);
}

Mat3 FeignedTurn(const Mat3& drift, const std::vector<Vec3>& points_C) {
  if (points_C.empty()) return Mat3::Zero();
  const auto count = static_cast<double>(points_C.size());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points_C) middle += p / count;
  double r2_m2 = 0;
  for (const Vec3& p : points_C) r2_m2 += (p - middle).head<2>().squaredNorm() / count;
  if (r2_m2 == 0) return Mat3::Zero();
  const double variance_rad2 = drift.topLeftCorner<2, 2>().trace() / 2 / (10 * r2_m2);
  const Vec3 turn_in_C(middle.y(), -middle.x(), 1);
  return variance_rad2 * turn_in_C * turn_in_C.transpose();
}

SubmapShape::SubmapShape(const SubmapPtr& submap, const SubmapAnchor& anchor,
                         LogOddsUnits occupied_from, const LoopClosureOptions& options,
                         const IcpOptions& icp)
    : submap(submap),
      id(submap->id()),
      anchor(anchor),
      occupied_from(occupied_from),
      cloud(CloudFor(icp,
                     Transformed(anchor.X_MC.inverse(), OccupiedPoints(submap->grid, occupied_from,
                                                                       options.min_neighbours)),
                     Vec3::Zero())),
      content_drift(anchor.content_drift + FeignedTurn(submap->drift, cloud.points())),
      cells(options.cell_m),
      occupied_cells(CellsAround(cells, cloud.points())) {}

std::vector<bool> PointsIn(const SubmapShape& target, const SubmapShape& source,
                           const Pose3& X_ik) {
  std::vector<bool> is_in;
  for (const Vec3& p_k : source.cloud.points()) is_in.push_back(target.HasNear(X_ik * p_k));
  return is_in;
}

double PredictOverlap(const SubmapShape& target, const SubmapShape& source, const Pose3& X_ik,
                      std::size_t most_points) {
  std::size_t shared = 0;
  const std::size_t used = ForSpreadPoints(
      source.cloud, most_points, [&](const Vec3& p_k) { shared += target.HasNear(X_ik * p_k); });
  return used == 0 ? 0 : static_cast<double>(shared) / static_cast<double>(used);
}

}  // namespace vog
