#include "lib/vogmap/merged_grid.h"

#include <gtest/gtest.h>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

TEST(MergedGridTest, HoldsTheAnswerOfEveryVoxel) {
  Random random(1, "merged_grid");
  VogMap map(0.1, SensorModel(SensorModelOptions{}));
  for (int id = 0; id < 4; ++id) map.Place(RandomSubmap(id, 0.1, random), RandomPose(1, random));
  const BrickGrid open = GridOf(0.1, RandomTable(300, 6, random));
  map.SetOpen(&open, RandomPose(1, random));

  const BrickGrid dut = MergedGrid(map);
  EXPECT_EQ(dut.grid().voxel_size_m(), 0.1);
  std::vector<float> answers;
  const VoxelBox box{{-40, -40, -40}, {40, 40, 40}};
  map.LogOddsIn(box, answers);
  int known = 0;
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    const float answer = answers[box.IndexOf(voxel)];
    const LogOddsUnits units = dut.Get(voxel);
    ASSERT_EQ(units != kUnknownUnits, IsKnown(answer));
    if (IsKnown(answer)) {
      ASSERT_EQ(ToLogOdds(units), answer);
    }
    known += IsKnown(answer);
  });
  EXPECT_GT(known, 1000);
  EXPECT_EQ(TableOf(dut).size(), static_cast<std::size_t>(known));  // Nothing beyond the box.
}

TEST(MergedGridTest, OfAnEmptyMapIsEmpty) {
  EXPECT_EQ(MergedGrid(VogMap(0.1, SensorModel(SensorModelOptions{}))).bricks(), 0u);
}

}  // namespace
}  // namespace vog
