#include "lib/baselines/incremental_merge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

class IncrementalMergeTest : public testing::Test {
 protected:
  void Place(SubmapId id, const Pose3& X_WM) {
    const SubmapPtr submap = RandomSubmap(id, kVoxel_m, random_);
    submaps_[id] = {TableOf(submap->grid), X_WM};
    dut_.Place(submap, X_WM);
  }

  /// The merged grid by the letter: forward, submap by submap, clamped after each addition.
  VoxelTable LiteralMerge() const {
    VoxelTable merged;
    for (const auto& [id, placed] : submaps_) {
      for (const auto& [key, units] : placed.first) {
        const Vec3 p_W = placed.second * (kVoxel_m * Vec3(key.x + 0.5, key.y + 0.5, key.z + 0.5));
        const auto index = [](double x) { return static_cast<int>(std::floor(1 / kVoxel_m * x)); };
        int& sum = merged[{index(p_W.x()), index(p_W.y()), index(p_W.z())}];
        sum = std::min<int>(std::max<int>(sum + units, model_.min), model_.max);
      }
    }
    return merged;
  }

  void ExpectLiteralMerge() const {
    const VoxelTable merged = LiteralMerge();
    const VoxelBox box{{-30, -30, -30}, {29, 29, 29}};
    std::vector<float> answers;
    dut_.LogOddsIn(box, answers);
    std::size_t known = 0;
    for (const float answer : answers) known += IsKnown(answer);
    EXPECT_EQ(known, merged.size());
    for (const auto& [key, units] : merged) ASSERT_EQ(answers[box.IndexOf(key)], ToLogOdds(units));
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SensorModel model_{SensorModelOptions{}};
  std::map<SubmapId, std::pair<VoxelTable, Pose3>> submaps_;  // At X_WM.
  IncrementalMergeMap dut_{kVoxel_m, model_};
};

TEST_F(IncrementalMergeTest, MovesVoxelsForwardIntoOneGrid) {
  ExpectLiteralMerge();
  for (int id = 0; id < 4; ++id) {
    Place(id, RandomPose(0.8, random_));
    ExpectLiteralMerge();
  }
}

TEST_F(IncrementalMergeTest, MergesAnewWhatHasMoved) {
  for (int id = 0; id < 4; ++id) Place(id, RandomPose(0.8, random_));
  ExpectLiteralMerge();
  submaps_[1].second = RandomPose(0.8, random_);
  dut_.Move({{1, submaps_[1].second}});
  ExpectLiteralMerge();
  Place(2, submaps_[2].second);  // Another content.
  ExpectLiteralMerge();
  submaps_.erase(0);
  dut_.Remove(0);
  ExpectLiteralMerge();
  Place(0, RandomPose(0.8, random_));  // Comes first again, though it was told last.
  ExpectLiteralMerge();
}

TEST_F(IncrementalMergeTest, AddsTheOpenSubmapToTheAnswer) {
  Place(0, Pose3::Identity());
  const VoxelTable closed = submaps_[0].first;
  BrickGrid open = GridOf(kVoxel_m, RandomTable(500, 8, random_));
  dut_.SetOpen(&open, Pose3::Identity());
  for (const auto& [key, units] : TableOf(open)) {
    const auto found = closed.find(key);
    const int sum = units + (found == closed.end() ? 0 : found->second);
    float answer;
    dut_.LogOddsOf({&key, 1}, {&answer, 1});
    EXPECT_EQ(answer, ToLogOdds(model_.Clamp(sum)));
  }
}

}  // namespace
}  // namespace vog
