#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"
#include "lib/vogmap/vog_map.h"

namespace vog {

/// A map as it lies on disk: its submaps at their poses, and the graph that holds them.
struct StoredMap {
  double voxel_size_m = 0;
  SensorModelOptions sensor_model;
  std::int64_t run_id = 0;
  /// The mission was over when this was saved and every submap had its final pose.
  bool complete = false;
  std::vector<SubmapPtr> submaps;  ///< In order of their numbers.
  std::map<SubmapId, Pose3> X_WM;  ///< One for each submap.
  std::string graph_g2o;           ///< The text of graph.g2o.
};

/// The map to ask questions of; the submaps are shared.
VogMap ToVogMap(const StoredMap& stored);

/// A map folder and what went wrong with parts of it.
struct LoadedMap {
  StoredMap map;
  /// A line for each submap that was left out because its file is missing or damaged.
  std::vector<std::string> faults;
};

/// Writes map folders: `map.toml` (voxel size, sensor model, one entry a submap with its base pose
/// and check sum), `submaps/000000.ot` (OctoMap files in the submaps' own frames) and `graph.g2o`.
/// Each file is replaced atomically, map.toml last, and a submap's file is written only when it is
/// new. A crash leaves the map of before or the new one.
class MapFolderWriter {
 public:
  /// Creates the folder. @throws SystemError.
  explicit MapFolderWriter(std::filesystem::path folder);

  /// Keeps a submap's file and entry. `octree_bytes` is what ToOctreeBytes() gives for it.
  /// @throws SystemError; the folder then still holds the map of before.
  void AddSubmap(const Submap& submap, const std::string& octree_bytes);

  /// Writes graph.g2o and map.toml. @pre every submap was added. @throws SystemError as above.
  void Commit(const StoredMap& map);

  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  std::map<SubmapId, std::uint32_t> checksums_;
};

/// True where `folder` holds a map.toml.
bool IsMapFolder(const std::filesystem::path& folder);

/// Reads a map folder. A damaged submap is named in `faults` and left out; the rest loads.
/// @throws UsageError when there is no map, or map.toml itself is damaged.
LoadedMap LoadMapFolder(const std::filesystem::path& folder);

/// Saves a whole map. @throws SystemError.
void SaveMapFolder(const StoredMap& map, const std::filesystem::path& folder);

}  // namespace vog
