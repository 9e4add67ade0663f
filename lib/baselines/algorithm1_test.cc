#include "lib/baselines/algorithm1.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/occupancy/answers_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

class Algorithm1Test : public testing::Test {
 protected:
  void Place(SubmapId id, const VoxelTable& table, const Pose3& X_WM) {
    submaps_[id] = {table, X_WM};
    dut_.Place(MakeSubmap(id, GridOf(kVoxel_m, table), random_), X_WM);
  }
  void PlaceRandom(int count) {
    for (int id = 0; id < count; ++id)
      Place(id, RandomTable(1500, 10, random_), RandomPose(0.8, random_));
  }

  /// The loop over the submaps by the letter, without boxes and trees: clamped after each addition.
  float LiteralLogOdds(const Vec3& p_W) const {
    float sum = 0;
    bool is_known = false;
    for (const auto& [id, placed] : submaps_) {
      const auto& [table, X_WM] = placed;
      const auto found = table.find(VoxelGrid(kVoxel_m).KeyOf(X_WM.inverse() * p_W));
      if (found == table.end()) continue;
      sum = std::min(std::max(sum + found->second / 32.0f, model_.min / 32.0f), model_.max / 32.0f);
      is_known = true;
    }
    return is_known ? sum : kUnknownLogOdds;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SensorModel model_{SensorModelOptions{}};
  std::map<SubmapId, std::pair<VoxelTable, Pose3>> submaps_;
  Algorithm1Map dut_{kVoxel_m, model_};
};

TEST_F(Algorithm1Test, OccupancyAlongARayIsThePapersLoop) {
  PlaceRandom(6);
  int known = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3 c = RandomPoint(1.6, random_), v = RandomPoint(1, random_).normalized();
    const std::vector<double> occupancy = dut_.OccupancyAlong(c, v, 0.07, 30);
    ASSERT_EQ(occupancy.size(), 30u);
    for (int k = 1; k <= 30; ++k) {
      const float log_odds = LiteralLogOdds(c + k * 0.07 * v);
      const double expected = IsKnown(log_odds) ? 1 - 1 / (1 + std::exp(double{log_odds})) : 0.5;
      EXPECT_NEAR(occupancy[k - 1], expected, 1e-9);
      known += IsKnown(log_odds);
    }
  }
  EXPECT_GT(known, 500);
}

TEST_F(Algorithm1Test, PointsAndVoxelsReadTheSameLoop) {
  PlaceRandom(6);
  std::vector<float> box_answers;
  const VoxelBox box{{-15, -15, -3}, {15, 15, 3}};
  dut_.LogOddsIn(box, box_answers);
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    const Vec3 center_W = dut_.grid().CenterOf(voxel);
    float at_point, of_voxel;
    dut_.LogOddsAt({&center_W, 1}, {&at_point, 1});
    dut_.LogOddsOf({&voxel, 1}, {&of_voxel, 1});
    ASSERT_PRED2(IsSameAnswer, at_point, LiteralLogOdds(center_W));
    ASSERT_PRED2(IsSameAnswer, of_voxel, at_point);
    ASSERT_PRED2(IsSameAnswer, box_answers[box.IndexOf(voxel)], at_point);
  });
}

TEST_F(Algorithm1Test, RaysReadTheSameAsTheirVoxels) {
  PlaceRandom(3);
  std::vector<RayVoxel> ray;
  int blocked = 0;
  for (int i = 0; i < 3000; ++i) {
    dut_.CastRay(RandomPoint(1.6, random_), RandomPoint(1, random_).normalized(), 2.5, ray);
    ASSERT_FALSE(ray.empty());
    for (const RayVoxel& step : ray) {
      EXPECT_PRED2(IsSameAnswer, step.log_odds, LiteralLogOdds(dut_.grid().CenterOf(step.key)));
      EXPECT_TRUE(&step == &ray.back() || !dut_.IsOccupied(step.log_odds));
    }
    blocked += dut_.IsOccupied(ray.back().log_odds);
  }
  EXPECT_GT(blocked, 1000);
}

TEST_F(Algorithm1Test, ClampsAfterEveryAddition) {
  const VoxelKey voxel{0, 0, 0};
  const Vec3 p_W = VoxelGrid(kVoxel_m).CenterOf(voxel);
  const int max = model_.max, min = model_.min;
  const int units[] = {max, max, min};  // The sum clamped once would be max.
  for (int id = 0; id < 3; ++id) Place(id, {{voxel, units[id]}}, Pose3::Identity());
  float log_odds;
  dut_.LogOddsAt({&p_W, 1}, {&log_odds, 1});
  EXPECT_EQ(log_odds, ToLogOdds(max + min));
}

TEST_F(Algorithm1Test, FollowsSubmapsThatMove) {
  PlaceRandom(3);
  Place(1, submaps_[1].first, RandomPose(0.8, random_));
  submaps_[2].second = RandomPose(0.8, random_);
  dut_.Move({{2, submaps_[2].second}});
  for (int i = 0; i < 500; ++i) {
    const Vec3 p_W = RandomPoint(1.6, random_);
    float log_odds;
    dut_.LogOddsAt({&p_W, 1}, {&log_odds, 1});
    EXPECT_PRED2(IsSameAnswer, log_odds, LiteralLogOdds(p_W));
  }
}

TEST_F(Algorithm1Test, AddsTheOpenSubmapLast) {
  const VoxelKey voxel{0, 0, 0};
  const int max = model_.max, min = model_.min;
  BrickGrid open = GridOf(kVoxel_m, {{voxel, min}});
  dut_.SetOpen(&open, Pose3::Identity());
  for (int id = 0; id < 2; ++id) Place(id, {{voxel, max}}, Pose3::Identity());
  float log_odds;
  dut_.LogOddsOf({&voxel, 1}, {&log_odds, 1});
  EXPECT_EQ(log_odds, ToLogOdds(max + min));
  open.At(voxel) = -1;
  dut_.NoteOpenGrew();
  dut_.LogOddsOf({&voxel, 1}, {&log_odds, 1});
  EXPECT_EQ(log_odds, ToLogOdds(max - 1));
}

// OctoMap's own clamps are narrower than a model's may be.
TEST_F(Algorithm1Test, SubmapsKeepTheirLogOdds) {
  SensorModelOptions wide;
  wide.min_probability = 0.02;
  wide.max_probability = 0.98;
  const SensorModel model(wide);
  Algorithm1Map map(kVoxel_m, model);
  const VoxelTable table = {{{0, 0, 0}, model.max}, {{1, 0, 0}, model.min}};
  map.Place(MakeSubmap(0, GridOf(kVoxel_m, table), random_), Pose3::Identity());
  std::vector<float> log_odds;
  map.LogOddsIn({{0, 0, 0}, {1, 0, 0}}, log_odds);
  EXPECT_EQ(log_odds, (std::vector<float>{ToLogOdds(model.max), ToLogOdds(model.min)}));
}

TEST_F(Algorithm1Test, NothingIsKnownWithoutSubmaps) {
  EXPECT_EQ(dut_.OccupancyAlong(Vec3::Zero(), Vec3::UnitX(), 0.1, 3),
            (std::vector<double>{0.5, 0.5, 0.5}));
}

}  // namespace
}  // namespace vog
