#pragma once

#include <filesystem>

#include "lib/vogmap/vog_map.h"

namespace vog {

/// Writes the merged map by the path's ending: .ot (OctoMap with log-odds), .bt (OctoMap, free or
/// occupied), .ply and .pcd (centres of the occupied voxels), .vtk (centres and log-odds of all
/// known voxels). Atomically. @throws UsageError for another ending, SystemError when the disk
/// refuses.
void ExportMap(const VogMap& map, const std::filesystem::path& path);

}  // namespace vog
