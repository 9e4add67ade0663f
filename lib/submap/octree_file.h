#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "lib/submap/brick_grid.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// The grid as an OctoMap .ot file: the bytes that OctoMap writes for a pruned OcTree of the same
/// voxels. Made without building the tree, some fifty times faster. The same grid gives the same
/// bytes.
std::string ToOctreeBytes(const BrickGrid& grid);

/// Reads an OctoMap .ot file (octrees of type OcTree). Returns the grid, or in one line why it
/// cannot: bytes that are damaged in any way are told, not trusted. Log-odds are rounded to units.
std::variant<BrickGrid, std::string> FromOctreeBytes(std::string_view bytes);

/// The same for a .bt file, in which a voxel is free or occupied: it becomes one at the lower or
/// the upper clamp of `model`.
std::variant<BrickGrid, std::string> FromBinaryOctreeBytes(std::string_view bytes,
                                                           const SensorModel& model);

}  // namespace vog
