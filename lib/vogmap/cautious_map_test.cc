#include "lib/vogmap/cautious_map.h"

#include <gtest/gtest.h>

#include <set>

#include "lib/occupancy/answers_testing.h"
#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/vog_map.h"

namespace vog {
namespace {

constexpr double kSide_m = 0.1;
constexpr double kSure_m = 0.25;
constexpr VoxelBox kBox = {{-12, -11, -10}, {11, 12, 9}};

class CautiousMapTest : public testing::Test {
 protected:
  void Place(SubmapId id, double sigma_m, double apart_m = 0.6) {
    const SubmapPtr submap = RandomSubmap(id, kSide_m, random_);
    const Pose3 X_WM = RandomPose(apart_m, random_);
    all_.Place(submap, X_WM);
    all_.SetSigmas({{id, sigma_m}});
  }

  /// What eq. 5 makes of the surely placed submaps and the open one.
  std::vector<float> SureAnswers() const {
    VogMap sure(kSide_m, model_);
    for (const SubmapId id : all_.ids())
      if (all_.sigma_m(id) <= kSure_m) sure.Place(all_.submap(id), all_.X_WM(id));
    sure.SetOpen(all_.open(), all_.X_open_W().inverse());
    std::vector<float> answers;
    sure.LogOddsIn(kBox, answers);
    return answers;
  }

  /// All ways to ask, against the definition; returns how many voxels have another state here.
  int ExpectOverruled() {
    dut_.Follow(kSure_m);
    const std::vector<float> sure = SureAnswers();
    std::vector<float> expected, in_box;
    all_.LogOddsIn(kBox, expected);
    const std::vector<SubmapId> ids = all_.ids();
    const bool are_all_sure = std::all_of(ids.begin(), ids.end(),
                                          [&](SubmapId id) { return all_.sigma_m(id) <= kSure_m; });
    int overruled = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!IsKnown(sure[i])) continue;
      overruled += all_.StateOf(sure[i]) != all_.StateOf(expected[i]);
      expected[i] = sure[i];
    }
    dut_.LogOddsIn(kBox, in_box);
    std::set<std::size_t> not_free;
    std::size_t i = 0;
    ForEachVoxel(kBox, [&](const VoxelKey& voxel) {
      const Vec3 center_W = all_.grid().CenterOf(voxel);
      float of_voxel, at_center;
      dut_.LogOddsOf({&voxel, 1}, {&of_voxel, 1});
      dut_.LogOddsAt({&center_W, 1}, {&at_center, 1});
      EXPECT_PRED2(IsSameAnswer, of_voxel, expected[i]);
      EXPECT_PRED2(IsSameAnswer, at_center, expected[i]);
      EXPECT_PRED2(IsSameAnswer, in_box[i], expected[i]);
      EXPECT_EQ(dut_.IsSurelyKnown({&voxel, 1}), are_all_sure || IsKnown(sure[i]));
      if (!all_.IsFree(expected[i])) not_free.insert(i);
      ++i;
    });
    std::vector<VoxelAnswer> answers;
    dut_.NotFreeIn(kBox, answers);
    EXPECT_EQ(answers.size(), not_free.size());
    for (const VoxelAnswer& answer : answers) {
      EXPECT_TRUE(not_free.count(kBox.IndexOf(answer.key)));
      EXPECT_PRED2(IsSameAnswer, answer.log_odds, expected[kBox.IndexOf(answer.key)]);
    }
    return overruled;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SensorModel model_{SensorModelOptions{}};
  VogMap all_{kSide_m, model_};
  CautiousMap dut_{all_, std::make_unique<VogMap>(kSide_m, model_)};
  BrickGrid open_{kSide_m};
};

TEST_F(CautiousMapTest, IsTheMapItselfWhereAllIsSurelyPlaced) {
  for (int id = 0; id < 6; ++id) Place(id, kSure_m);
  EXPECT_EQ(ExpectOverruled(), 0);
}

TEST_F(CautiousMapTest, WhatIsSurelyPlacedDecidesWhereItHasSeenAnything) {
  int overruled = 0;
  for (int id = 0; id < 30; ++id) {
    Place(id % 12, random_.Uniform(0, 2 * kSure_m));
    if (id % 5 == 1) {
      open_ = GridOf(kSide_m, RandomTable(500, 8, random_));
      all_.SetOpen(&open_, RandomPose(0.3, random_));
    }
    if (id % 7 == 3) all_.Remove(random_.Index(12));
    if (id % 3 == 2) all_.Move({{random_.Index(12), RandomPose(0.6, random_)}});
    if (id == 20) all_.SetOpen(nullptr, Pose3::Identity());
    overruled += ExpectOverruled();
  }
  EXPECT_GT(overruled, 100);
}

TEST_F(CautiousMapTest, TellsWhereAnswersHaveChanged) {
  constexpr double kApart_m = 3;
  const VoxelBox box = {{-25, -25, -12}, {25, 25, 12}};
  for (int id = 0; id < 8; ++id) Place(id, id < 4 ? 1 : 0.1, kApart_m);
  dut_.Follow(kSure_m);
  int unchanged = 0;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t revision = dut_.revision();
    std::vector<float> before, after;
    dut_.LogOddsIn(box, before);
    if (i % 4 == 0) all_.SetSigmas({{i / 4, 0.1}, {7 - i / 4, 1}});
    if (i % 4 == 2) all_.Move({{random_.Index(8), RandomPose(kApart_m, random_)}});
    if (i % 2 == 1) Place(random_.Index(8), random_.Uniform(0, 1), kApart_m);
    if (i == 15) {
      for (const SubmapId id : all_.ids()) all_.SetSigmas({{id, 0}});
    }
    dut_.Follow(kSure_m);
    EXPECT_GT(dut_.revision(), revision);
    dut_.LogOddsIn(box, after);
    const auto changed = dut_.ChangedSince(revision);
    if (!changed) continue;  // All may have.
    std::size_t v = 0;
    ForEachVoxel(box, [&](const VoxelKey& voxel) {
      const Vec3 center_W = all_.grid().CenterOf(voxel);
      const bool is_told = std::any_of(changed->begin(), changed->end(),
                                       [&](const auto& box_W) { return box_W.contains(center_W); });
      if (!is_told) {
        EXPECT_PRED2(IsSameAnswer, before[v], after[v]);
        ++unchanged;
      }
      ++v;
    });
  }
  EXPECT_GT(unchanged, 1000);
  const std::int64_t revision = dut_.revision();
  dut_.Follow(kSure_m);
  EXPECT_EQ(dut_.revision(), revision);
  EXPECT_TRUE(dut_.ChangedSince(revision)->empty());
  EXPECT_FALSE(dut_.ChangedSince(revision + 1).has_value());
}

}  // namespace
}  // namespace vog
