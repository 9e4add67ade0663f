#include "lib/baselines/culling.h"

#include <algorithm>
#include <numbers>

namespace vog {
namespace {

double HalfDiagonal(const VoxelGrid& grid) { return std::numbers::sqrt3 / 2 * grid.voxel_size_m(); }

Eigen::AlignedBox3d BoxOf(std::span<const Vec3> points_W) {
  Eigen::AlignedBox3d box_W;
  for (const Vec3& p_W : points_W) box_W.extend(p_W);
  return box_W;
}

Eigen::AlignedBox3d BoxOf(const VoxelGrid& grid, std::span<const VoxelKey> voxels) {
  Eigen::AlignedBox3d box_W;
  for (const VoxelKey& voxel : voxels) box_W.extend(grid.CenterOf(voxel));
  return box_W;
}

}  // namespace

Ball::Ball(const VoxelGrid& grid, const Eigen::AlignedBox3d& places_W)
    : center_W_(places_W.center()),
      radius_m_(places_W.diagonal().norm() / 2 + HalfDiagonal(grid)) {}

Ball::Ball(const VoxelGrid& grid, std::span<const Vec3> points_W) : Ball(grid, BoxOf(points_W)) {}

Ball::Ball(const VoxelGrid& grid, std::span<const VoxelKey> voxels)
    : Ball(grid, BoxOf(grid, voxels)) {}

Ball::Ball(const VoxelGrid& grid, const VoxelBox& voxels)
    : Ball(grid, Eigen::AlignedBox3d(grid.CenterOf(voxels.min), grid.CenterOf(voxels.max))) {}

bool Ball::Touches(const Eigen::AlignedBox3d& box_M, const Pose3& X_MW) const {
  return !box_M.isEmpty() && box_M.exteriorDistance(X_MW * center_W_) <= radius_m_;
}

Segment::Segment(const VoxelGrid& grid, const Vec3& origin_W, const Vec3& direction_W,
                 double length_m)
    : origin_W_(origin_W),
      direction_W_(direction_W),
      length_m_(length_m),
      margin_m_(HalfDiagonal(grid)) {}

// Slab test.
bool Segment::Touches(const Eigen::AlignedBox3d& box_M, const Pose3& X_MW) const {
  if (box_M.isEmpty()) return false;
  const Vec3 origin_M = X_MW * origin_W_, direction_M = X_MW.linear() * direction_W_;
  double enter_m = 0, leave_m = length_m_;
  for (int axis = 0; axis < 3; ++axis) {
    const double lo = box_M.min()[axis] - margin_m_ - origin_M[axis];
    const double hi = box_M.max()[axis] + margin_m_ - origin_M[axis];
    if (direction_M[axis] == 0) {
      if (lo > 0 || hi < 0) return false;
      continue;
    }
    const double a = lo / direction_M[axis], b = hi / direction_M[axis];
    enter_m = std::max(enter_m, std::min(a, b));
    leave_m = std::min(leave_m, std::max(a, b));
  }
  return enter_m <= leave_m;
}

}  // namespace vog
