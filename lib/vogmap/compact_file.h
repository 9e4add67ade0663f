#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "lib/base/files.h"
#include "lib/vogmap/map_entries.h"

namespace vog {

/// Writes a map once more as one file that needs no reading: all that its map.toml says, and the
/// grids as they lie in memory. `map_toml` is the text of that map.toml, `grids` and
/// `octree_bytes` (the sizes of the octrees' files) are in the order of the entries. The same map
/// gives the same bytes. Atomically. @throws SystemError.
void WriteCompactFile(const std::filesystem::path& path, const std::string& map_toml,
                      const MapEntries& entries, std::span<const BrickGrid* const> grids,
                      std::span<const std::uint64_t> octree_bytes);

/// What there is beside a map.toml.
enum class CompactState {
  kMissing,
  kStale,    ///< Of another map.toml, or of another version of this program.
  kDamaged,  ///< In whole or in part.
  kValid,
};

/// A compact file, mapped into memory. Nothing of it is believed before its check sum was right.
class CompactFile {
 public:
  /// Nothing unless the file is whole and belongs to `map_toml`; `state` says why. The grids'
  /// voxels are not looked at yet.
  static std::optional<CompactFile> Open(const std::filesystem::path& path,
                                         const std::string& map_toml, CompactState& state);

  const MapEntries& entries() const { return entries_; }

  /// Whether the i-th submap's octree, as it now lies in `folder`, is still the one of this file:
  /// of the same size and older than the file.
  bool IsOf(const std::filesystem::path& folder, std::size_t i) const;

  /// The i-th submap's grid, which borrows this file's memory; nothing if its voxels are damaged.
  std::optional<BrickGrid> Grid(std::size_t i) const;

 private:
  CompactFile() = default;

  std::shared_ptr<const MappedFile> file_;
  MapEntries entries_;
};

}  // namespace vog
