#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "lib/submap/brick_grid.h"

namespace vog {

/// The grid as an OctoMap .ot file: the bytes that OctoMap writes for a pruned OcTree of the same
/// voxels. Made without building the tree, some fifty times faster. The same grid gives the same
/// bytes.
std::string ToOctreeBytes(const BrickGrid& grid);

/// Reads an OctoMap .ot file (octrees of type OcTree). Returns the grid, or in one line why it
/// cannot: bytes that are damaged in any way are told, not trusted. Log-odds are rounded to units.
std::variant<BrickGrid, std::string> FromOctreeBytes(std::string_view bytes);

}  // namespace vog
