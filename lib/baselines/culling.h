#pragma once

#include <span>

#include "lib/occupancy/occupancy_map.h"

/// What a query can touch in W, so that submaps whose boxes lie elsewhere need not be asked. Each
/// extent is half a voxel's diagonal wider than what is asked: answers for rays are at the centres
/// of voxels, which lie beside them, and rounding must leave nobody out.
namespace vog {

/// A ball around all places of a query.
class Ball {
 public:
  Ball(const VoxelGrid& grid, std::span<const Vec3> points_W);
  Ball(const VoxelGrid& grid, std::span<const VoxelKey> voxels);
  Ball(const VoxelGrid& grid, const VoxelBox& voxels);

  bool Touches(const Eigen::AlignedBox3d& box_M, const Pose3& X_MW) const;

 private:
  Ball(const VoxelGrid& grid, const Eigen::AlignedBox3d& places_W);

  Vec3 center_W_;
  double radius_m_;
};

/// The straight way of a ray. `direction_W` is a unit vector.
class Segment {
 public:
  Segment(const VoxelGrid& grid, const Vec3& origin_W, const Vec3& direction_W, double length_m);

  /// Whether it comes as near to the box as the margin along each axis of M.
  bool Touches(const Eigen::AlignedBox3d& box_M, const Pose3& X_MW) const;

 private:
  Vec3 origin_W_, direction_W_;
  double length_m_, margin_m_;
};

}  // namespace vog
