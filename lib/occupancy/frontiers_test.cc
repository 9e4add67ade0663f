#include "lib/occupancy/frontiers.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/occupancy/grid_map_testing.h"

namespace vog {
namespace {

/// A map in which each voxel near the origin is free, occupied or unknown by chance.
GridMap RandomMap(Random& random) {
  GridMap map(0.1);
  ForEachVoxel({{-6, -6, -6}, {6, 6, 6}}, [&](const VoxelKey& voxel) {
    const int kind = random.Index(6);
    if (kind > 0) map.Set(voxel, kind == 1 ? GridMap::kOccupied : GridMap::kFree);
  });
  return map;
}

TEST(FrontiersTest, AreTheFreeVoxelsBesideUnknownOnes) {
  Random random(1, "frontiers");
  for (int i = 0; i < 20; ++i) {
    const GridMap map = RandomMap(random);
    const VoxelKey corner{random.Index(8) - 8, random.Index(8) - 8, random.Index(8) - 8};
    const VoxelBox box{
        corner,
        {corner.x + random.Index(9), corner.y + random.Index(9), corner.z + random.Index(9)}};
    std::vector<VoxelKey> expected;
    ForEachVoxel(box, [&](const VoxelKey& v) {
      const VoxelKey sides[] = {{v.x - 1, v.y, v.z}, {v.x + 1, v.y, v.z}, {v.x, v.y - 1, v.z},
                                {v.x, v.y + 1, v.z}, {v.x, v.y, v.z - 1}, {v.x, v.y, v.z + 1}};
      const bool beside =
          std::any_of(std::begin(sides), std::end(sides),
                      [&](const VoxelKey& side) { return !IsKnown(map.Get(side)); });
      if (map.IsFree(map.Get(v)) && beside) expected.push_back(v);
    });
    EXPECT_EQ(FrontiersIn(map, box), expected);
  }
}

TEST(FrontiersTest, KnownSpaceHasNone) {
  GridMap map(0.1);
  map.Fill({{-5, -5, -5}, {5, 5, 5}}, GridMap::kFree);
  EXPECT_TRUE(FrontiersIn(map, {{-4, -4, -4}, {4, 4, 4}}).empty());
  EXPECT_EQ(FrontiersIn(map, {{-5, -5, -5}, {5, 5, 5}}).size(), 11u * 11 * 11 - 9 * 9 * 9);
}

}  // namespace
}  // namespace vog
