#pragma once

#include <filesystem>
#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// Points, and the pose that they were seen from: X_WV, with V the frame of the points.
struct CloudFile {
  std::vector<Vec3> points_V;
  Pose3 X_WV = Pose3::Identity();
};

/// Reads a point cloud: .pcd (ASCII or binary; VIEWPOINT is X_WV; points that are not finite are
/// left out) or the vertices of a .ply (ASCII or binary little-endian). @throws UsageError naming
/// file and fault.
CloudFile ReadCloud(const std::filesystem::path& path);

/// Writes points as a .ply of 32-bit floats, binary, or a .pcd, by the path's ending; atomically.
/// @throws UsageError for another ending, SystemError when the disk refuses.
void WriteCloud(const std::filesystem::path& path, const std::vector<Vec3>& points);

}  // namespace vog
