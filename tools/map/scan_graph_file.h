#pragma once

#include <filesystem>
#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// A scan of an OctoMap scan log: where the sensor was, and the end points it saw, in its frame.
struct GraphScan {
  Pose3 X_WS = Pose3::Identity();
  std::vector<Vec3> points_S;
};

/// Reads OctoMap's binary scan log (.graph, as octomap::ScanGraph::writeBinary() makes it; its own
/// reader aborts the program on a damaged file). The constraints between scans, which follow them
/// in the file, are not read. @throws UsageError naming the file when it is none, cut short or
/// without scans.
std::vector<GraphScan> ReadScanGraph(const std::filesystem::path& file);

}  // namespace vog
