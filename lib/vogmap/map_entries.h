#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lib/submap/put_in.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// A pose as map folders hold it: x, y, z, qx, qy, qz, qw.
using StoredPose = std::array<double, 7>;

/// In place of a CRC-32 that cannot be read.
inline constexpr std::uint64_t kNoChecksum = ~std::uint64_t{0};

/// What map.toml says of where the mission ended. Plain numbers without gaps, as all entries below.
struct EndEntry {
  std::int64_t utime_us = 0;
  StoredPose X_ME{};
  std::array<double, 9> covariance{};
};

/// And of how the newest flight on the map began: what odometry told of its first submap's base.
struct PutInEntry {
  std::int64_t id = 0, utime_us = 0, origin = 0, segment = 0;
  StoredPose X_OM{}, edge_X_PM{};
  std::array<double, 9> covariance_OM{};
  std::array<double, 36> edge_covariance{};
};

/// What map.toml says of the map as a whole.
struct MapEntry {
  double voxel_size_m = 0;
  SensorModelOptions sensor_model;
  std::int64_t run_id = 0;
  bool complete = false;
  std::uint64_t graph_crc32 = 0;
  std::optional<EndEntry> end = {};
  std::optional<PutInEntry> put_in = {};
};

/// What map.toml says of a submap: all but its grid. Its bytes may be stored as they are.
struct SubmapEntry {
  std::int32_t id = 0, scans = 0;
  std::int64_t first_utime_us = 0, last_utime_us = 0, origin = 0, segment = 0;
  std::uint64_t octree_crc32 = 0;
  StoredPose X_WM{}, X_OM{}, X_ML{}, edge_X_PM{};
  std::array<double, 9> covariance_OM{}, drift{};
  std::array<double, 36> edge_covariance{};
};

struct MapEntries {
  MapEntry map;
  std::vector<SubmapEntry> submaps;
};

SubmapEntry EntryOf(const Submap& submap, const Pose3& X_WM, std::uint32_t octree_crc32);

/// The submap of an entry, with its grid.
SubmapPtr SubmapOf(const SubmapEntry& entry, BrickGrid grid);

EndEntry EntryOf(const PlaceInMap& end);
PlaceInMap EndOf(const EndEntry& entry);
PutInEntry EntryOf(const SubmapBase& put_in);
SubmapBase PutInOf(const PutInEntry& entry);

Pose3 ToPose(const StoredPose& stored);

/// The name of a submap's octree in a map folder.
std::string OctreeNameOf(SubmapId id);

std::string ToMapToml(const MapEntries& entries);

/// Reads the text of the map.toml at `file`. @throws UsageError naming file and line when it is
/// damaged.
MapEntries FromMapToml(const std::string& text, const std::string& file);

}  // namespace vog
