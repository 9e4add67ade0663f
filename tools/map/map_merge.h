#pragma once

#include <filesystem>
#include <vector>

#include "lib/vogmap/map_folder.h"

namespace vog {

/// Puts maps into one: their submaps in turn, renumbered without a gap, at the poses that they
/// have, and their graphs side by side with no edge between them. The run is 0 unless it is the
/// same for all. @throws UsageError naming the first map whose voxels or sensor model are not
/// those of the maps before.
StoredMap MergeMaps(const std::vector<std::filesystem::path>& folders);

}  // namespace vog
