#include "lib/vogmap/fuse_submaps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/vog_map.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

PlacedSubmap PlacedAt(SubmapPtr submap, const Pose3& X_WM) {
  PlacedSubmap placed{std::move(submap), X_WM, X_WM.inverse(), {}, 0};
  placed.bounds_M = placed.submap->grid.BrickBounds();
  return placed;
}

/// The same voxels with a sixth of the units: sums of a few of them pass no clamp.
SubmapPtr Faint(const SubmapPtr& submap, Random& random) {
  VoxelTable table = TableOf(submap->grid);
  for (auto& [key, units] : table) units /= 6;
  return MakeSubmap(submap->id(), GridOf(kVoxel_m, table), random);
}

class FuseSubmapsTest : public testing::Test {
 protected:
  PlacedSubmap RandomPlaced(SubmapId id) {
    return PlacedAt(RandomSubmap(id, kVoxel_m, random_), RandomPose(0.8, random_));
  }
  std::vector<PlacedSubmap> RandomPlaced(SubmapId from, int count) {
    std::vector<PlacedSubmap> submaps;
    for (int i = 0; i < count; ++i) submaps.push_back(RandomPlaced(from + i));
    return submaps;
  }

  /// Adds what `placed` says at `p_W` to a sum; false where it knows nothing.
  static bool AddAt(const PlacedSubmap& placed, const Vec3& p_W, int& sum) {
    const BrickGrid& grid = placed.submap->grid;
    const LogOddsUnits units = grid.Get(grid.grid().KeyOf(placed.X_MW * p_W));
    if (units == kUnknownUnits) return false;
    sum += units;
    return true;
  }

  /// By the letter of what Fuse() promises: `parts` at the centre of the voxel of the first that
  /// holds the point, clamped, then the rest of the map, clamped.
  float ExpectedAt(const std::vector<PlacedSubmap>& parts, const std::vector<PlacedSubmap>& rest,
                   const Vec3& p_W) const {
    const VoxelGrid& grid = parts[0].submap->grid.grid();
    const Vec3 center_W = parts[0].X_WM * grid.CenterOf(grid.KeyOf(parts[0].X_MW * p_W));
    EXPECT_LE((center_W - p_W).norm(), 0.5 * std::sqrt(3) * kVoxel_m + 1e-9);
    int sum = 0;
    bool is_known = false;
    for (const PlacedSubmap& part : parts) is_known |= AddAt(part, center_W, sum);
    sum = model_.Clamp(sum);
    for (const PlacedSubmap& other : rest) is_known |= AddAt(other, p_W, sum);
    return is_known ? ToLogOdds(model_.Clamp(sum)) : kUnknownLogOdds;
  }

  SensorModel model_{SensorModelOptions{}};
  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(FuseSubmapsTest, AnswersWithTheSumOfThePartsAtTheCentreOfTheVoxel) {
  int known = 0;
  for (int round = 0; round < 20; ++round) {
    const auto parts = RandomPlaced(0, 1 + random_.Index(5));
    const auto rest = RandomPlaced(10, random_.Index(4));
    VogMap map(kVoxel_m, model_);
    map.Place(Fuse(parts[0], std::span(parts).subspan(1), model_), parts[0].X_WM);
    for (const PlacedSubmap& other : rest) map.Place(other.submap, other.X_WM);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p_W = RandomPoint(1.2, random_);
      float answer;
      map.LogOddsAt({&p_W, 1}, {&answer, 1});
      const float expected = ExpectedAt(parts, rest, p_W);
      ASSERT_TRUE(answer == expected || (!IsKnown(answer) && !IsKnown(expected)))
          << answer << " " << expected;
      known += IsKnown(answer);
    }
  }
  EXPECT_GT(known, 4000);
}

TEST_F(FuseSubmapsTest, OneAloneIsItself) {
  const PlacedSubmap placed = RandomPlaced(3);
  const SubmapPtr fused = Fuse(placed, {}, model_);
  EXPECT_EQ(TableOf(fused->grid), TableOf(placed.submap->grid));
  EXPECT_EQ(fused->id(), 3);
  EXPECT_EQ(fused->last_scan, placed.submap->last_scan);
  EXPECT_TRUE(fused->base.edge.X_PM.isApprox(placed.submap->base.edge.X_PM));
}

TEST_F(FuseSubmapsTest, TheOrderOfThePartsDoesNotMatter) {
  auto parts = RandomPlaced(0, 5);
  const VoxelTable fused = TableOf(Fuse(parts[0], std::span(parts).subspan(1), model_)->grid);
  std::reverse(parts.begin() + 1, parts.end());
  EXPECT_EQ(TableOf(Fuse(parts[0], std::span(parts).subspan(1), model_)->grid), fused);
}

// Where voxels coincide and no clamp cuts, no answer changes at all.
TEST_F(FuseSubmapsTest, ShiftsByWholeVoxelsChangeNothing) {
  std::vector<PlacedSubmap> parts;
  VogMap apart(kVoxel_m, model_), fused(kVoxel_m, model_);
  const Pose3 X_WM = RandomPose(1, random_);
  for (int id = 0; id < 4; ++id) {
    const Vec3 shift_m = kVoxel_m * Vec3(3 * id, -5 * id, id);
    parts.push_back(
        PlacedAt(Faint(RandomSubmap(id, kVoxel_m, random_), random_), X_WM * MakePose(shift_m)));
    apart.Place(parts.back().submap, parts.back().X_WM);
  }
  fused.Place(Fuse(parts[0], std::span(parts).subspan(1), model_), X_WM);
  int known = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p_W = X_WM * RandomPoint(1, random_);
    float before, after;
    apart.LogOddsAt({&p_W, 1}, {&before, 1});
    fused.LogOddsAt({&p_W, 1}, {&after, 1});
    ASSERT_TRUE(before == after || (!IsKnown(before) && !IsKnown(after)));
    known += IsKnown(before);
  }
  EXPECT_GT(known, 1000);
}

TEST_F(FuseSubmapsTest, InStepsIsAtOnceWhereNoClampCuts) {
  auto parts = RandomPlaced(0, 4);
  for (PlacedSubmap& part : parts) part.submap = Faint(part.submap, random_);
  PlacedSubmap steps = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) steps.submap = Fuse(steps, {&parts[i], 1}, model_);
  EXPECT_EQ(TableOf(steps.submap->grid),
            TableOf(Fuse(parts[0], std::span(parts).subspan(1), model_)->grid));
}

TEST_F(FuseSubmapsTest, OverlapIsTheShareOfCommonBricks) {
  BrickGrid one(kVoxel_m), two(kVoxel_m);
  one.At({0, 0, 0}) = 1;
  two.At({0, 0, 0}) = 1;
  two.At({8, 0, 0}) = 1;
  const Pose3 X_WM = RandomPose(5, random_);
  const PlacedSubmap small = PlacedAt(MakeSubmap(0, one, random_), X_WM);
  const PlacedSubmap large = PlacedAt(MakeSubmap(1, two, random_), X_WM);
  const PlacedSubmap beside =
      PlacedAt(MakeSubmap(2, two, random_), X_WM * MakePose({8 * kVoxel_m, 0, 0}));
  const PlacedSubmap empty = PlacedAt(MakeSubmap(3, BrickGrid(kVoxel_m), random_), X_WM);
  EXPECT_EQ(OverlapOf(small, large), 1);
  EXPECT_EQ(OverlapOf(large, small), 0.5);
  EXPECT_EQ(OverlapOf(large, beside), 0.5);
  EXPECT_EQ(OverlapOf(small, beside), 0);
  EXPECT_EQ(OverlapOf(empty, small), 0);
  EXPECT_EQ(OverlapOf(small, empty), 0);
}

}  // namespace
}  // namespace vog
