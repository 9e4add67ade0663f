#include "lib/vogmap/lane_sum.h"

#include <gtest/gtest.h>

#include <deque>
#include <numbers>
#include <numeric>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

/// Some submaps at poses, and the sums over them by the definition.
class LaneSumTest : public testing::Test {
 protected:
  ~LaneSumTest() override { AllowWideInstructions(true); }

  /// `sign`: as SubmapLanes::Set().
  void Add(SubmapPtr submap, const Pose3& X_WM, std::int32_t sign = 1) {
    PlacedSubmap placed{std::move(submap), X_WM, X_WM.inverse(), {}, 0};
    placed.bounds_M = placed.submap->grid.BrickBounds();
    placed_.push_back(std::move(placed));
    const std::size_t i = placed_.size() - 1;
    if (i % kLanes == 0) lanes_.emplace_back();
    lanes_.back().Set(static_cast<int>(i % kLanes), &placed_.back(), kVoxel_m, sign);
    signs_.push_back(sign);
  }

  VoxelSum Literal(const VoxelKey& voxel) const {
    VoxelSum sum;
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      const PlacedSubmap& placed = placed_[i];
      const BrickGrid& grid = placed.submap->grid;
      const LogOddsUnits units = grid.Get(grid.grid().KeyOf(placed.X_MW * grid_.CenterOf(voxel)));
      if (units == kUnknownUnits) continue;
      sum.units += signs_[i] * units;
      sum.observers += signs_[i];
    }
    return sum;
  }

  /// All voxels of `block`, together and one by one, with and without wide instructions; returns
  /// the sum of observers.
  int ExpectLiteral(const VoxelKey& block) {
    const auto candidates = CandidatesOf(lanes_, grid_, block);
    std::vector<int> voxels(kBlockVoxels);
    std::iota(voxels.begin(), voxels.end(), 0);
    std::vector<VoxelSum> sums(kBlockVoxels);
    for (const bool wide : {true, false}) {
      AllowWideInstructions(wide);
      SumCandidates(candidates, grid_, block, voxels, sums);
      ExpectLiteral(block, voxels, sums);
      for (int i = 0; i < kBlockVoxels; ++i)
        SumCandidates(candidates, grid_, block, {&i, 1}, {&sums[i], 1});
      ExpectLiteral(block, voxels, sums);
    }
    int observers = 0;
    for (const VoxelSum& sum : sums) observers += sum.observers;
    return observers;
  }

  void ExpectLiteral(const VoxelKey& block, std::span<const int> voxels,
                     std::span<const VoxelSum> sums) const {
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      const VoxelKey offset = OffsetInBlock(voxels[i]);
      const VoxelKey voxel{8 * block.x + offset.x, 8 * block.y + offset.y, 8 * block.z + offset.z};
      const VoxelSum expected = Literal(voxel);
      EXPECT_EQ(sums[i].units, expected.units) << voxel.x << " " << voxel.y << " " << voxel.z;
      EXPECT_EQ(sums[i].observers, expected.observers);
    }
  }

  int ExpectLiteralAround(int blocks) {
    int observers = 0;
    for (int z = -blocks; z < blocks; ++z)
      for (int y = -blocks; y < blocks; ++y)
        for (int x = -blocks; x < blocks; ++x) observers += ExpectLiteral({x, y, z});
    return observers;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  VoxelGrid grid_{kVoxel_m};
  std::deque<PlacedSubmap> placed_;
  std::vector<std::int32_t> signs_;
  std::vector<SubmapLanes> lanes_;
};

TEST_F(LaneSumTest, IsTheDefinitionAtRandomPoses) {
  for (int id = 0; id < 29; ++id)
    Add(RandomSubmap(id, kVoxel_m, random_), RandomPose(0.8, random_));
  EXPECT_GT(ExpectLiteralAround(3), 10000);
}

TEST_F(LaneSumTest, TakesAwayWhatIsToBeTakenOut) {
  for (int id = 0; id < 29; ++id)
    Add(RandomSubmap(id, kVoxel_m, random_), RandomPose(0.8, random_), id % 3 == 0 ? -1 : 1);
  EXPECT_GT(ExpectLiteralAround(3), 3000);
}

// Every place is on a voxel's border or within rounding of it: only double can tell.
TEST_F(LaneSumTest, IsTheDefinitionWhereCentersFallOnBorders) {
  for (int id = 0; id < 20; ++id) {
    const auto half_voxels = [&] { return 0.5 * kVoxel_m * (random_.Index(9) - 4); };
    const double x_m = half_voxels(), y_m = half_voxels();
    const double yaw = std::numbers::pi / 2 * random_.Index(4);
    Add(RandomSubmap(id, kVoxel_m, random_), MakePose({x_m, y_m, half_voxels()}, {0, 0, yaw}));
  }
  EXPECT_GT(ExpectLiteralAround(3), 10000);
}

TEST_F(LaneSumTest, IsTheDefinitionFarFromTheOrigin) {
  const Vec3 far(5000, -7000, 300);
  for (int id = 0; id < 11; ++id) {
    Pose3 X_WM = RandomPose(0.5, random_);
    X_WM.translation() += far;
    Add(RandomSubmap(id, kVoxel_m, random_), X_WM);
  }
  int observers = 0;
  const VoxelKey middle = grid_.KeyOf(far);
  for (int i = 0; i < 8; ++i)
    observers += ExpectLiteral(
        {(middle.x >> 3) + i % 2, (middle.y >> 3) + i / 2 % 2, (middle.z >> 3) + i / 4});
  EXPECT_GT(observers, 1000);
}

TEST_F(LaneSumTest, KnowsNothingWithoutSubmapsNear) {
  EXPECT_EQ(ExpectLiteral({0, 0, 0}), 0);
  Add(MakeSubmap(0, BrickGrid(kVoxel_m), random_), Pose3::Identity());
  EXPECT_EQ(ExpectLiteral({0, 0, 0}), 0);
  Add(RandomSubmap(1, kVoxel_m, random_), MakePose({500, 0, 0}));
  EXPECT_TRUE(CandidatesOf(lanes_, grid_, {0, 0, 0}).empty());
}

}  // namespace
}  // namespace vog
