#include "lib/occupancy/frontiers.h"

#include <array>

namespace vog {
namespace {

/// A layer of a box with a margin of one voxel, at one z.
struct Layer {
  VoxelBox box;
  std::vector<float> log_odds;

  bool IsUnknown(std::int32_t x, std::int32_t y) const {
    return !IsKnown(log_odds[box.IndexOf({x, y, box.min.z})]);
  }
};

Layer ReadLayer(const OccupancyMap& map, const VoxelBox& box, std::int32_t z) {
  Layer layer{{{box.min.x - 1, box.min.y - 1, z}, {box.max.x + 1, box.max.y + 1, z}}, {}};
  map.LogOddsIn(layer.box, layer.log_odds);
  return layer;
}

}  // namespace

std::vector<VoxelKey> FrontiersIn(const OccupancyMap& map, const VoxelBox& box) {
  std::vector<VoxelKey> frontiers;
  std::array<Layer, 3> layers = {
      ReadLayer(map, box, box.min.z - 1), ReadLayer(map, box, box.min.z), {}};
  for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
    layers[2] = ReadLayer(map, box, z + 1);
    const Layer& at = layers[1];
    ForEachVoxel({{box.min.x, box.min.y, z}, {box.max.x, box.max.y, z}}, [&](const VoxelKey& v) {
      if (!map.IsFree(at.log_odds[at.box.IndexOf(v)])) return;
      if (at.IsUnknown(v.x - 1, v.y) || at.IsUnknown(v.x + 1, v.y) || at.IsUnknown(v.x, v.y - 1) ||
          at.IsUnknown(v.x, v.y + 1) || layers[0].IsUnknown(v.x, v.y) ||
          layers[2].IsUnknown(v.x, v.y))
        frontiers.push_back(v);
    });
    layers[0] = std::move(layers[1]);
    layers[1] = std::move(layers[2]);
  }
  return frontiers;
}

}  // namespace vog
