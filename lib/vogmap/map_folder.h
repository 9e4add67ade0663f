#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"
#include "lib/vogmap/compact_file.h"
#include "lib/vogmap/map_entries.h"
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
  /// Where the vehicle was when the mission ended; nothing before, and in maps of other origin.
  std::optional<PlaceInMap> end = {};
  /// The base of the newest flight's first submap, on the map of earlier flights.
  std::optional<SubmapBase> put_in = {};
};

/// The map to ask questions of; the submaps are shared.
VogMap ToVogMap(const StoredMap& stored);

/// A map folder and what went wrong with parts of it.
struct LoadedMap {
  StoredMap map;
  /// A line for each submap that was left out because its file is missing or damaged.
  std::vector<std::string> faults;
  CompactState compact = CompactState::kMissing;
  std::size_t octrees_read = 0;  ///< Submaps that do not come from the compact file.
};

/// Writes map folders: `map.toml` (voxel size, sensor model, one entry a submap with its base pose
/// and check sum), `submaps/000000.ot` (OctoMap files in the submaps' own frames), `graph.g2o`, and
/// once the map is complete `compact.bin`, which holds all of it for fast opening. Only what has
/// changed is written.
///
/// A crash at any moment leaves the map of before or the new one, whatever map the folder held:
/// each file is replaced atomically; a new file whose name the old map needs waits under another
/// name until map.toml, which comes last, has made the new map the one that is there.
class MapFolderWriter {
 public:
  /// Creates the folder. @throws SystemError.
  explicit MapFolderWriter(std::filesystem::path folder);

  /// Keeps a submap's file and entry. `octree_bytes` is what ToOctreeBytes() gives for it.
  /// @throws SystemError; the folder then still holds the map of before.
  void AddSubmap(const Submap& submap, const std::string& octree_bytes);

  /// Makes `map` the one that the folder holds. @pre every submap was added. @throws SystemError as
  /// above.
  void Commit(const StoredMap& map);

  const std::filesystem::path& folder() const { return folder_; }

 private:
  struct Octree {
    std::uint32_t crc32;
    std::uint64_t bytes;
  };

  void Stage(const std::string& name, const std::string& bytes, std::uint32_t crc32);
  void PutInPlace();
  void RemoveLeftovers();
  void WriteCompact(const StoredMap& map, const std::string& map_toml, const MapEntries& entries);

  std::filesystem::path folder_;
  std::map<SubmapId, Octree> octrees_;
  std::map<std::string, std::string> waiting_;  // Names, and those they wait under.
  bool is_tidy_ = false;
};

/// True where `folder` holds a map.toml.
bool IsMapFolder(const std::filesystem::path& folder);

/// The run that the map in a folder is of; its submaps are not read. @throws UsageError when there
/// is no map, or map.toml is damaged.
std::int64_t RunIdOfMap(const std::filesystem::path& folder);

/// Whether loading may use the compact file.
enum class CompactUse { kAllowed, kForbidden };

/// Reads a map folder: its compact file where that is valid, otherwise all octrees, with as many
/// threads as there are. A damaged submap is named in `faults` and left out; the rest loads.
/// Nothing is written. The same result with and without a compact file.
/// @throws UsageError when there is no map, or map.toml itself is damaged.
LoadedMap LoadMapFolder(const std::filesystem::path& folder, CompactUse use = CompactUse::kAllowed);

/// Saves a whole map. @throws SystemError.
void SaveMapFolder(const StoredMap& map, const std::filesystem::path& folder);

/// Makes the compact file of a map anew from its octrees. @throws UsageError when there is no map
/// or it is damaged, SystemError.
void PackMapFolder(const std::filesystem::path& folder);

}  // namespace vog
