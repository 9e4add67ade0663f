#include "lib/planner/explorer.h"

#include <gtest/gtest.h>

#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

const Waypoint kStart{{-1.5, -0.5, 0}, 0};

/// A vehicle that flies its plans at once and sees as it goes.
class ExplorerTest : public testing::Test {
 protected:
  ExplorerTest() { Restart(); }

  void Restart() {
    explorer_.emplace(options_, MotionLimits{},
                      ExplorationOptions{ChamberBox().min(), ChamberBox().max()}, sonar_, mission_);
    explorer_->SetStart(kStart.position_W_m);
    known_ = GridMap(kChamberVoxel_m);
    at_ = kStart;
    Look(truth_, sonar_, at_.X_WB(), known_);
  }

  const Plan* Update(double seconds = 1) {
    now_ += FromSeconds(seconds);
    return explorer_->Update(known_, at_.X_WB(), now_, submaps_);
  }
  /// Whether the true walls are in the way of the bare hull.
  bool IsTrulyFree(const Waypoint& from, const Waypoint& to) const {
    CollisionRules bare = options_.collision_rules();
    bare.clearance_m = bare.unknown_clearance_m = 0;
    return CollisionChecker(bare).IsEdgeFree(truth_, from, to);
  }
  void Fly(const std::vector<Waypoint>& path) {
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      EXPECT_TRUE(IsTrulyFree(path[i], path[i + 1])) << "plan " << explorer_->plan()->id;
      for (const double fraction : {0.5, 1.0}) {
        at_ = Interpolate(path[i], path[i + 1], fraction);
        Look(truth_, sonar_, at_.X_WB(), known_);
      }
    }
  }
  /// Explores until the end; returns the number of plans.
  int Explore(int most = 300) {
    int plans = 0;
    for (; plans < most && explorer_->state() == ExplorerState::kExploring; ++plans) {
      const Plan* plan = Update(3);
      if (plan == nullptr) continue;
      EXPECT_LT(LengthOf(plan->path.front(), at_), 1e-9) << "a path begins at the vehicle";
      Fly(plan->path);
    }
    return plans;
  }

  const GridMap truth_ = Chamber();
  const SonarOptions sonar_ = WideSonar();
  PlannerOptions options_ = SmallPlanner();
  MissionOptions mission_;
  std::optional<Explorer> explorer_;
  GridMap known_{kChamberVoxel_m};
  Waypoint at_ = kStart;
  Time now_{};
  int submaps_ = 0;
};

TEST_F(ExplorerTest, ExploresAClosedRoomUntilNothingIsLeft) {
  const double before_m3 = explorer_->ExploredVolume(known_);
  const int plans = Explore();
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_GT(plans, 5);
  int unknown = 0, all = 0;
  ForEachVoxel(VoxelsOf(truth_.grid(), ChamberBox()), [&](const VoxelKey& key) {
    if (truth_.IsOccupied(truth_.Get(key))) return;
    ++all;
    unknown += !IsKnown(known_.Get(key));
  });
  EXPECT_LT(unknown, 0.03 * all);
  EXPECT_GT(explorer_->ExploredVolume(known_), 2 * before_m3);
  // At the end: stay, and no more plans.
  EXPECT_EQ(explorer_->plan()->path.size(), 1u);
  EXPECT_EQ(Update(100), nullptr);
}

TEST_F(ExplorerTest, ExploredVolumeIsTheKnownShareOfTheBox) {
  EXPECT_EQ(explorer_->ExploredVolume(GridMap(kChamberVoxel_m)), 0);
  EXPECT_NEAR(explorer_->ExploredVolume(truth_), ChamberBox().volume(), 1e-9);
}

TEST_F(ExplorerTest, IsAFunctionOfItsSeed) {
  Explore(10);
  const Waypoint first = at_;
  Restart();
  Explore(10);
  EXPECT_EQ(at_.position_W_m, first.position_W_m);
  mission_.seed = 2;
  Restart();
  Explore(10);
  EXPECT_NE(at_.position_W_m, first.position_W_m);
}

TEST_F(ExplorerTest, FirstEdgeIsFlownAndTheRestBeginsTheNextTree) {
  int seeded = 0;
  for (int i = 0; i < 10 && explorer_->state() == ExplorerState::kExploring; ++i) {
    const Plan* made = Update(3);
    ASSERT_NE(made, nullptr);
    if (explorer_->state() == ExplorerState::kFinished) break;
    const Plan plan = *made;
    ASSERT_EQ(plan.path.size(), 2u);
    std::vector<Waypoint> branch;
    for (int n = plan.best; n >= 0; n = plan.tree[static_cast<std::size_t>(n)].parent)
      branch.insert(branch.begin(), plan.tree[static_cast<std::size_t>(n)].at);
    ASSERT_GE(branch.size(), 2u);
    EXPECT_EQ(branch[1].position_W_m, plan.path[1].position_W_m);
    Fly(plan.path);
    if (branch.size() < 3) continue;
    const Plan* next = Update(3);
    if (next == nullptr || next->tree.size() < branch.size() - 1) continue;
    // As far as it is still free, the rest is the new tree's first branch.
    const TreeNode& first = next->tree[1];
    if ((first.at.position_W_m - branch[2].position_W_m).norm() < 1e-9) {
      EXPECT_EQ(first.parent, 0);
      ++seeded;
    }
    Fly(next->path);
  }
  EXPECT_GT(seeded, 0);
}

TEST_F(ExplorerTest, KeepsItsPlanUntilItIsReached) {
  ASSERT_NE(Update(), nullptr);
  const Plan plan = *explorer_->plan();
  EXPECT_EQ(plan.id, 1);
  at_ = Interpolate(plan.path[0], plan.path[1], 0.5);
  EXPECT_EQ(Update(), nullptr);
  EXPECT_EQ(explorer_->plan()->id, 1);
  at_ = plan.path[1];
  at_.yaw_rad += 0.5 * options_.goal_tolerance_rad;
  EXPECT_NE(Update(), nullptr);
  EXPECT_EQ(explorer_->plan()->id, 2);
}

TEST_F(ExplorerTest, PlansAnewWhenTheMapClosesTheWay) {
  const Plan* plan = Update();
  ASSERT_NE(plan, nullptr);
  while (LengthOf(plan->path[0], plan->path[1]) < 1) {
    Fly(plan->path);
    plan = Update(3);
    ASSERT_NE(plan, nullptr);
  }
  const std::int64_t id = plan->id;
  EXPECT_EQ(Update(2), nullptr);
  known_.Set(known_.grid().KeyOf(plan->path[1].position_W_m), GridMap::kOccupied);
  EXPECT_EQ(Update(0.1), nullptr) << "looks once a second";
  const Plan* next = Update(1.5);
  ASSERT_NE(next, nullptr);
  EXPECT_GT(next->id, id);
}

TEST_F(ExplorerTest, PlansAnewWhenThePlanTakesTooLong) {
  ASSERT_NE(Update(), nullptr);
  EXPECT_EQ(Update(50), nullptr);
  EXPECT_NE(Update(15), nullptr);
}

TEST_F(ExplorerTest, EndsWithTheBudget) {
  mission_.max_submaps = 5;
  Restart();
  submaps_ = 4;
  ASSERT_NE(Update(), nullptr);
  EXPECT_EQ(explorer_->state(), ExplorerState::kExploring);
  submaps_ = 5;
  const Plan* last = Update();
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "max_submaps");
  ASSERT_EQ(last->path.size(), 1u);
  EXPECT_EQ(last->path[0].position_W_m, at_.position_W_m);
}

TEST_F(ExplorerTest, MayVisitOldPlacesAgain) {
  mission_.when_done = WhenDone::kRevisit;
  Restart();
  Explore();
  ASSERT_EQ(explorer_->state(), ExplorerState::kRevisiting);
  double flown_m = 0;
  for (int i = 0; i < 20; ++i) {
    const Waypoint from = at_;
    if (const Plan* plan = Update(3)) Fly(plan->path);
    flown_m += LengthOf(from, at_);
  }
  EXPECT_EQ(explorer_->state(), ExplorerState::kRevisiting);
  EXPECT_GT(flown_m, 3);
  submaps_ = mission_.max_submaps;
  Update();
  EXPECT_EQ(explorer_->end_reason(), "max_submaps");
}

TEST_F(ExplorerTest, WaitsAndGivesUpWhereNothingCanMove) {
  known_ = GridMap(kChamberVoxel_m);
  // Walled in, out of the bubble, nothing travelled that it could back out along.
  at_ = {{1.5, 1.5, 0}, 0};
  ForEachVoxel({{-18, -13, -7}, {17, 12, 6}},
               [&](const VoxelKey& key) { known_.Set(key, GridMap::kOccupied); });
  int holds = 0;
  for (int i = 0; i < 200 && explorer_->state() == ExplorerState::kExploring; ++i) {
    const Plan* plan = Update(3);
    if (plan == nullptr) continue;
    EXPECT_EQ(plan->path.size(), 1u);
    ++holds;
  }
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "stuck");
  EXPECT_GT(holds, 20);
}

TEST_F(ExplorerTest, BacksOutAlongTheWayItCame) {
  for (int i = 0; i < 8; ++i) {
    const Plan* plan = Update(3);
    ASSERT_NE(plan, nullptr);
    Fly(plan->path);
  }
  const Waypoint before = at_;
  // The map moves: an obstacle touches the hull.
  const Vec3 beside_W = at_.X_WB() * Vec3(0.35, 0, 0);
  const VoxelKey key = known_.grid().KeyOf(beside_W);
  known_.Fill({{key.x, key.y - 1, key.z - 1}, {key.x, key.y + 1, key.z + 1}}, GridMap::kOccupied);
  const Plan* plan = nullptr;
  for (int i = 0; i < 80 && plan == nullptr; ++i) plan = Update(1);
  ASSERT_NE(plan, nullptr);
  EXPECT_GT(plan->path.size(), 1u);
  EXPECT_GT(LengthOf(plan->path.back(), before), 0.2);
}

}  // namespace
}  // namespace vog
