#pragma once

#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// The frontier voxels in `box` [Yamauchi 1997]: free ones with an unknown neighbour across one of
/// their six faces, which may lie outside the box. In the order of VoxelBox::IndexOf. Reads three
/// layers of the box at a time.
std::vector<VoxelKey> FrontiersIn(const OccupancyMap& map, const VoxelBox& box);

}  // namespace vog
