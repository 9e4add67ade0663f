#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lib/base/time.h"
#include "lib/geometry/odometry.h"
#include "lib/geometry/pose.h"
#include "lib/submap/brick_grid.h"

namespace vog {

/// A submap's number, also its node's in the pose graph and its file's in a map folder.
using SubmapId = int;

/// The motion from the previous submap's base P to this submap's base M, by odometry.
struct OdometryEdge {
  Pose3 X_PM = Pose3::Identity();
  Mat6 covariance = Mat6::Identity();
};

/// What odometry tells of a submap's base, the frame M: the body's pose at its first scan.
struct SubmapBase {
  SubmapId id = 0;
  OdometrySample odometry;  ///< At the first scan; X_OB is X_OM.
  OdometryEdge edge;        ///< From submap id - 1; identity for the first.
};

/// A small occupancy grid in a frame of its own. Frozen once it is closed; only its pose in W
/// moves, and that is not its own affair.
struct Submap {
  SubmapBase base;
  Time first_scan, last_scan;
  int scans = 0;
  Pose3 X_ML = Pose3::Identity();  ///< The body at the last scan.
  /// Covariance of (x, y, yaw) of the body's motion from the first to the last scan: how far the
  /// content may be bent.
  Mat3 drift = Mat3::Zero();
  BrickGrid grid;

  SubmapId id() const { return base.id; }
};

using SubmapPtr = std::shared_ptr<const Submap>;

/// The voxels from `occupied_from` up, without those that have fewer than `min_neighbours` occupied
/// ones among their 26.
std::vector<VoxelKey> OccupiedVoxels(const BrickGrid& grid, LogOddsUnits occupied_from,
                                     int min_neighbours = 0);
/// Their centres in M.
std::vector<Vec3> OccupiedPoints(const BrickGrid& grid, LogOddsUnits occupied_from,
                                 int min_neighbours = 0);

}  // namespace vog
