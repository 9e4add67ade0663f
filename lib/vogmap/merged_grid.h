#pragma once

#include "lib/submap/brick_grid.h"
#include "lib/vogmap/vog_map.h"

namespace vog {

/// The whole map as one grid in W: the cached answer of every known global voxel. For pictures,
/// exports and snapshots; the map itself is never merged. Cost grows with the volume of the map.
BrickGrid MergedGrid(const VogMap& map);

}  // namespace vog
