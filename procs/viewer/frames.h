#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lib/messages/convert.h"
#include "lib/occupancy/occupancy_map.h"
#include "lib/scan/scan.h"
#include "procs/viewer/frame.h"
#include "vog/graph_t.hpp"
#include "vog/plan_t.hpp"

namespace vog {

// Binary frames, little-endian as typed arrays of browsers are. Each begins with 16 bytes: kind
// (uint32), count of what follows the fixed part (uint32), utime_us (float64). A pose is seven
// float32: x, y, z [m] and the quaternion w, x, y, z.

/// A submap's occupied voxels, in M, without those that are almost alone. Fixed: id (uint32),
/// voxel_size_m (float32), last utime_us (float64). Each: key x, y, z (int16), and the direction to
/// free space in octahedral coordinates (2 x int8). In an order without pattern, so that any first
/// part of them shows the whole coarsely.
std::string SubmapFrame(const Submap& submap, LogOddsUnits occupied_from);

/// A submap's place with what it is coloured by.
struct ViewedPlace {
  SubmapPlace place;
  std::optional<double> true_error_m;  ///< Of the base's position; a simulation knows.
};
/// Fixed: version (float64). Each: id (uint32), X_WM, standard deviation of the position [m] and
/// its true error [m] or NaN (float32).
std::string PosesFrame(Time time, std::int64_t version, std::span<const ViewedPlace> places);

/// Fixed: X_BS, range at which the window begins and ends [m] (float32). Each beam: bearing_rad,
/// range_m (float32), 0 without an echo, negative where nothing is known.
std::string ScanFrame(const Scan& scan);

/// Fixed: X_WB, the upper triangle of the position's covariance in W [m^2] (6 x float32), speed
/// [m/s] and yaw rate [rad/s] (float32).
struct ViewedEstimate {
  Time time;
  Pose3 X_WB = Pose3::Identity();
  Mat6 covariance_WB = Mat6::Zero();
  double speed_m_s = 0, yaw_rate_rad_s = 0;
};
std::string EstimateFrame(const ViewedEstimate& estimate);

/// Fixed: X_WB. For odometry and truth.
std::string BodyFrame(FrameKind kind, Time time, const Pose3& X_WB);

/// Fixed: version (float64). Each edge: from, to (uint32), kind, directions (uint8), number of the
/// reason (uint16), chi-square (float32), up to two directions of translation that a partial
/// closure leaves free, in the frame of `to`, zero where there are fewer (6 x float32). Then the
/// reasons, a JSON list.
std::string GraphFrame(const graph_t& graph);

/// A point of a path. `anchor` is the submap that `position_m` is relative to, -1 for W.
struct TrailPoint {
  Time time;
  SubmapId anchor = -1;
  Vec3 position_m = Vec3::Zero();
};
/// Fixed: number of the path (uint32), its part (uint32). Each: utime_us (float64), anchor (int32),
/// position (3 x float32).
std::string TrailFrame(int trail, int part, std::span<const TrailPoint> points);

/// Fixed: corner x, y, z of the block [voxels] (3 x int32), voxel_size_m (float32). Each: x, y, z
/// from there (3 x uint8).
std::string FrontierFrame(const VoxelKey& corner, double voxel_size_m,
                          std::span<const VoxelKey> frontiers);

/// {"k":"plan"}: path, tree, best branch, gains.
std::string PlanFrame(const plan_t& plan);

}  // namespace vog
