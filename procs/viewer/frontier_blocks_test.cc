#include "procs/viewer/frontier_blocks.h"

#include <gtest/gtest.h>

#include "lib/occupancy/frontiers.h"
#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/vog_map.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

class FrontierBlocksTest : public testing::Test {
 protected:
  /// Takes in what the next looks at up to `max_blocks` find.
  int Look(FrontierBlocks& dut, int max_blocks) {
    int changed = 0;
    for (const auto& [corner, frontiers] : dut.Update(max_blocks)) {
      shown_[corner] = frontiers;
      ++changed;
    }
    return changed;
  }
  void LookUntilUpToDate(FrontierBlocks& dut) {
    for (int i = 0; i < 10000 && !dut.IsUpToDate(); ++i) Look(dut, 3);
    EXPECT_TRUE(dut.IsUpToDate());
  }
  std::set<VoxelKey> Shown() const {
    std::set<VoxelKey> all;
    for (const auto& [corner, frontiers] : shown_) all.insert(frontiers.begin(), frontiers.end());
    return all;
  }
  std::set<VoxelKey> Expected() const {
    const auto frontiers = FrontiersIn(map_, VoxelsOf(map_.grid(), box_W_));
    return {frontiers.begin(), frontiers.end()};
  }

  VogMap map_{kVoxel_m, SensorModel(SensorModelOptions())};
  const Eigen::AlignedBox3d box_W_{Vec3(-2.33, -1.9, -1.2), Vec3(2.71, 2.2, 1.3)};
  Random random_{1, "frontiers"};
  std::map<VoxelKey, std::vector<VoxelKey>> shown_;
};

TEST_F(FrontierBlocksTest, BlockByBlockItShowsTheMapsFrontiers) {
  FrontierBlocks dut(map_, box_W_);
  for (int id = 0; id < 4; ++id) {
    map_.Place(RandomSubmap(id, kVoxel_m, random_),
               MakePose({0.5 * id, -0.3 * id, 0.1}, {0, 0, 0.4 * id}));
    LookUntilUpToDate(dut);
    EXPECT_GT(Shown().size(), 100u);
    EXPECT_EQ(Shown(), Expected());
  }
  // A loop closure moves some.
  map_.Move({{1, MakePose({-0.8, 0.2, 0})}, {2, MakePose({0.9, 0.9, 0.2}, {0, 0, 1})}});
  EXPECT_FALSE(dut.IsUpToDate());
  LookUntilUpToDate(dut);
  EXPECT_EQ(Shown(), Expected());
  map_.Remove(0);
  LookUntilUpToDate(dut);
  EXPECT_EQ(Shown(), Expected());
}

TEST_F(FrontierBlocksTest, OnlyWhatChangedIsLookedAtAndTold) {
  FrontierBlocks dut(map_, box_W_);
  map_.Place(RandomSubmap(0, kVoxel_m, random_), MakePose({-1, -1, 0}));
  const SubmapPtr small = [&] {
    auto submap = std::make_shared<Submap>(*RandomSubmap(1, kVoxel_m, random_));
    submap->grid = GridOf(kVoxel_m, {{{0, 0, 0}, -20}, {{1, 0, 0}, -20}});
    return submap;
  }();
  map_.Place(small, MakePose({2, 1.5, 0.5}));
  LookUntilUpToDate(dut);
  EXPECT_EQ(Look(dut, 1000), 0);
  map_.Move({{1, MakePose({2, 1.5, 0.9})}});
  const int told = Look(dut, 1000);
  EXPECT_GE(told, 1);
  EXPECT_LE(told, 8);
  EXPECT_EQ(Shown(), Expected());
}

}  // namespace
}  // namespace vog
