#include "lib/planner/explorer.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

const Waypoint kStart{{-1.5, -0.5, 0}, 0};

/// A vehicle that flies its plans at once and sees as it goes.
class ExplorerTest : public testing::Test {
 protected:
  ExplorerTest() {
    exploration_.min_m = ChamberBox().min();
    exploration_.max_m = ChamberBox().max();
    options_.kind = PlannerKind::kNextBestView;
    mission_.when_done = WhenDone::kEnd;
    Restart();
  }

  void Restart() {
    explorer_.emplace(options_, MotionLimits{}, exploration_, sonar_, mission_);
    explorer_->SetStart(kStart.position_W_m);
    known_ = GridMap(kChamberVoxel_m);
    at_ = kStart;
    Look(truth_, sonar_, at_.X_WB(), known_);
  }

  const Plan* Update(double seconds = 1, const std::string& hold = {}) {
    now_ += FromSeconds(seconds);
    return explorer_->Update(known_, at_.X_WB(), now_, submaps_, hold);
  }
  /// Whether the true walls are in the way of the bare hull, but for what corners graze between two
  /// samples of an edge.
  bool IsTrulyFree(const Waypoint& from, const Waypoint& to) const {
    CollisionRules bare = options_.collision_rules();
    bare.clearance_m = bare.unknown_clearance_m = 0;
    bare.hull_size_m -= Vec3::Constant(kChamberVoxel_m / 8);
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

  GridMap truth_ = Chamber();
  SonarOptions sonar_ = WideSonar();
  PlannerOptions options_ = SmallPlanner();
  ExplorationOptions exploration_;
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

TEST_F(ExplorerTest, TheWayItCameMovesWithTheSubmaps) {
  explorer_->SetSubmaps({{0, MakePose({1, 2, 3}, {0, 0, 1})}});
  std::vector<Vec3> passed_W;
  for (int i = 0; i < 8; ++i) {
    passed_W.push_back(at_.position_W_m);
    const Plan* plan = Update(3);
    ASSERT_NE(plan, nullptr);
    Fly(plan->path);
  }
  const Vec3 moved_m(0.05, 0.1, 0);
  explorer_->SetSubmaps({{0, MakePose(Vec3(1, 2, 3) + moved_m, {0, 0, 1})}});
  at_.position_W_m += moved_m;
  const VoxelKey key = known_.grid().KeyOf(at_.X_WB() * Vec3(0.35, 0, 0));
  known_.Fill({{key.x, key.y - 1, key.z - 1}, {key.x, key.y + 1, key.z + 1}}, GridMap::kOccupied);
  const Plan* plan = nullptr;
  for (int i = 0; i < 80 && plan == nullptr; ++i) plan = Update(1);
  ASSERT_NE(plan, nullptr);
  ASSERT_GT(plan->path.size(), 1u);
  for (std::size_t i = 1; i < plan->path.size(); ++i) {
    double nearest_m = 1;
    for (const Vec3& p_W : passed_W)
      nearest_m = std::min(nearest_m, (plan->path[i].position_W_m - p_W - moved_m).norm());
    EXPECT_LT(nearest_m, 1e-9);
  }
}

TEST_F(ExplorerTest, DoesNotBackOutThroughWhatIsSurelyThere) {
  for (int i = 0; i < 8; ++i) {
    const Plan* plan = Update(3);
    ASSERT_NE(plan, nullptr);
    Fly(plan->path);
  }
  // The map moves: walls stand around the hull, and across the way it came.
  const Vec3 room_m = 0.5 * options_.hull_size_m + Vec3::Constant(0.12);
  ForEachVoxel({{-18, -13, -7}, {17, 12, 6}}, [&](const VoxelKey& key) {
    const Vec3 p_B = at_.X_WB().inverse() * known_.grid().CenterOf(key);
    const bool is_inside = (p_B.cwiseAbs().array() < room_m.array()).all();
    known_.Set(key, is_inside ? GridMap::kFree : GridMap::kOccupied);
  });
  for (int i = 0; i < 60; ++i) {
    const Plan* plan = Update(3);
    if (plan == nullptr) continue;
    for (const Waypoint& waypoint : plan->path) EXPECT_LT(LengthOf(waypoint, at_), 0.3);
  }
}

TEST_F(ExplorerTest, WaysOutKeepTheirDistanceFromWhatIsNotSurelyThere) {
  GridMap posts = Chamber();
  for (const double x_m : {-2.7, -0.3})
    posts.Fill(VoxelsOf(posts.grid(), {Vec3(x_m, -1.1, -1.2), Vec3(x_m, -1.1, 1.1)}),
               GridMap::kOccupied);
  posts.SetSigma(0.6);
  CollisionChecker all(options_.collision_rules());
  for (int seed = 1; seed <= 10; ++seed) {
    mission_.seed = seed;
    Restart();
    known_ = posts;
    // Beside the vehicle, in less than its clearance.
    known_.Fill(VoxelsOf(known_.grid(), {Vec3(-2.5, 0.1, -1.2), Vec3(-0.5, 0.1, 1.1)}),
                GridMap::kOccupied);
    const Plan* plan = Update();
    ASSERT_NE(plan, nullptr);
    ASSERT_GE(plan->path.size(), 2u) << seed;
    for (std::size_t i = 0; i + 1 < plan->path.size(); ++i)
      EXPECT_TRUE(all.IsEdgeFree(posts, plan->path[i], plan->path[i + 1])) << seed;
  }
}

/// The same with the planner of coverage, and home at the end.
class CoverageTest : public ExplorerTest {
 protected:
  CoverageTest() {
    options_.kind = PlannerKind::kCoverage;
    mission_.when_done = WhenDone::kReturn;
    Restart();
  }
  double UnknownShare() const {
    int unknown = 0, all = 0;
    ForEachVoxel(VoxelsOf(truth_.grid(), ChamberBox()), [&](const VoxelKey& key) {
      if (truth_.IsOccupied(truth_.Get(key))) return;
      ++all;
      unknown += !IsKnown(known_.Get(key));
    });
    return static_cast<double>(unknown) / all;
  }
  void FlyToTheEnd(int most = 300) {
    for (int i = 0; i < most && explorer_->state() != ExplorerState::kFinished; ++i)
      if (const Plan* plan = Update(3)) Fly(plan->path);
  }
  /// Follows the plans in small steps, the explorer told each time where the vehicle is.
  void Step() {
    constexpr double kStep_m = 0.2;
    if (const Plan* plan = Update(0.5)) route_ = plan->path;
    if (route_.empty()) return;
    const double left_m = LengthOf(at_, route_.front());
    const Waypoint next =
        Interpolate(at_, route_.front(), left_m > kStep_m ? kStep_m / left_m : 1.0);
    EXPECT_TRUE(IsTrulyFree(at_, next)) << "plan " << explorer_->plan()->id;
    at_ = next;
    Look(truth_, sonar_, at_.X_WB(), known_);
    if (left_m <= kStep_m) route_.erase(route_.begin());
  }
  /// The start's voxel and `n` to all sides.
  VoxelBox AroundStart(int n) const {
    const VoxelKey middle = known_.grid().KeyOf(kStart.position_W_m);
    return {{middle.x - n, middle.y - n, middle.z - n}, {middle.x + n, middle.y + n, middle.z + n}};
  }
  std::vector<Waypoint> route_;  // What is left of the plan.
  double ToStart_m() const { return (at_.position_W_m - kStart.position_W_m).norm(); }
};

TEST_F(CoverageTest, ExploresAClosedRoomAndComesHome) {
  FlyToTheEnd();
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_LT(UnknownShare(), 0.02);
  // What is left: nothing but voxels in corners, and those that were hidden.
  int unseen = 0;
  ForEachVoxel(VoxelsOf(truth_.grid(), ChamberBox()), [&](const VoxelKey& key) {
    if (IsKnown(known_.Get(key))) return;
    bool is_beside_free = false;
    for (const auto& [dx, dy, dz] :
         {std::array{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
      const VoxelKey beside{key.x + dx, key.y + dy, key.z + dz};
      is_beside_free |= VoxelsOf(truth_.grid(), ChamberBox()).Contains(beside) &&
                        known_.IsFree(known_.Get(beside));
    }
    unseen += is_beside_free;
  });
  EXPECT_NEAR(static_cast<double>(explorer_->unseen().voxels), unseen, 0.1 * unseen + 5)
      << "but for what the way home showed";
  EXPECT_LE(explorer_->unseen().in_vain, explorer_->unseen().voxels);
  EXPECT_TRUE(explorer_->is_home());
  EXPECT_LT(ToStart_m(), 0.51);
  EXPECT_EQ(Update(100), nullptr);
}

/// Offers a submap that was made at the start, and counts what becomes of it.
class LocalisingTest : public CoverageTest {
 protected:
  /// Flies to the end; while it localises, submaps are made if `closes`.
  void FlyOffered(double gain, bool closes = true) {
    constexpr int kMostSteps = 4000;
    ExplorerState before = explorer_->state();
    for (int i = 0; i < kMostSteps && explorer_->state() != ExplorerState::kFinished; ++i) {
      explorer_->SetRevisits({{0, kStart, kStart, gain}});
      Step();
      const bool is_there = ToStart_m() < 0.2 && std::abs(WrapAngle(at_.yaw_rad)) < 0.15;
      const bool localises = explorer_->state() == ExplorerState::kLocalising;
      localising_s_ += localises ? 0.5 : 0;
      visits_ += localises && before != ExplorerState::kLocalising;
      seen_again_ += localises && is_there;
      before = explorer_->state();
      if (i % 20 == 0 && (closes || !localises)) ++submaps_;
    }
    EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
    EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  }

  int visits_ = 0, seen_again_ = 0;
  double localising_s_ = 0;
};

TEST_F(LocalisingTest, SeesASubmapAgainAndGoesOn) {
  options_.revisit_share = 0.3;
  Restart();
  FlyOffered(0.9);
  EXPECT_GE(visits_, 1);
  EXPECT_GT(seen_again_, 20) << "it stays for a whole submap";
  EXPECT_LT(localising_s_, 0.35 * ToSeconds(now_.time_since_epoch()));
  EXPECT_LT(UnknownShare(), 0.02);
  EXPECT_TRUE(explorer_->is_home());
}

TEST_F(LocalisingTest, KnowsHowLongASubmapTakesOnTheMapOfEarlierFlights) {
  options_.revisit_share = 0.3;
  mission_.max_submaps = 1000;
  submaps_ = 500;
  Restart();
  FlyOffered(0.9);
  EXPECT_GE(visits_, 1);
  EXPECT_GT(seen_again_, 20);
}

TEST_F(LocalisingTest, DoesNotWaitForeverForASubmap) {
  options_.revisit_share = 0.3;
  Restart();
  FlyOffered(0.9, /*closes=*/false);
  EXPECT_GE(visits_, 1);
  EXPECT_LT(UnknownShare(), 0.02);
}

TEST_F(LocalisingTest, WithoutAShareOfTheTimeIsThePlainExplorer) {
  options_.revisit_share = 0;
  Restart();
  FlyOffered(0.9);
  EXPECT_EQ(visits_, 0);
  const Time end = now_;
  const Waypoint at = at_;
  now_ = Time{};
  submaps_ = 0;
  Restart();
  route_.clear();
  FlyOffered(0);
  EXPECT_EQ(now_, end);
  EXPECT_EQ(at_.position_W_m, at.position_W_m);
}

TEST_F(CoverageTest, GoesHomeWithItsBudgets) {
  mission_.max_distance_m = 4;
  Restart();
  FlyToTheEnd();
  EXPECT_EQ(explorer_->end_reason(), "max_distance");
  EXPECT_LT(ToStart_m(), 0.51);
  mission_.max_distance_m = 0;
  mission_.max_duration_s = 30;
  Restart();
  FlyToTheEnd();
  EXPECT_EQ(explorer_->end_reason(), "max_duration");
  EXPECT_LT(ToStart_m(), 0.51);
}

TEST_F(CoverageTest, GoesToAHomeThatIsNotTheStart) {
  exploration_.home = HomePlace::kPlace;
  exploration_.home_m = {-1.5, 1.2, 0};
  mission_.max_distance_m = 6;
  Restart();
  FlyToTheEnd();
  EXPECT_TRUE(explorer_->is_home());
  EXPECT_LT((at_.position_W_m - exploration_.home_m).norm(), 0.51);
}

// As when it is put in at a place that the map of earlier flights does not show.
TEST_F(CoverageTest, ALaterFlightBeginsElsewhereAndEndsAtTheFirstOnesStart) {
  at_.position_W_m = {-1.5, 1.2, 0};
  explorer_->SetStart(kStart.position_W_m, at_.position_W_m);
  known_ = GridMap(kChamberVoxel_m);
  Look(truth_, sonar_, at_.X_WB(), known_);
  FlyToTheEnd();
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_LT(UnknownShare(), 0.02);
  EXPECT_TRUE(explorer_->is_home());
  EXPECT_LT(ToStart_m(), 0.51);
}

TEST_F(CoverageTest, HoldsWhileItIsToldTo) {
  const Plan* plan = Update();
  ASSERT_NE(plan, nullptr);
  plan = Update(1, "no sonar");
  ASSERT_NE(plan, nullptr);
  ASSERT_EQ(plan->path.size(), 1u);
  EXPECT_EQ(plan->path[0].position_W_m, at_.position_W_m);
  EXPECT_EQ(explorer_->hold(), "no sonar");
  EXPECT_EQ(Update(100, "no sonar"), nullptr);
  EXPECT_EQ(explorer_->state(), ExplorerState::kExploring);
  plan = Update(1);
  ASSERT_NE(plan, nullptr) << "goes on at once";
  EXPECT_TRUE(explorer_->hold().empty());
}

TEST_F(CoverageTest, StaysOutOfKeepOutBoxes) {
  KeepOutOptions keep_out;
  keep_out.min_m = {-3.5, 0.6, -1.2};
  keep_out.max_m = {3.5, 2.5, 1.2};
  exploration_.keep_out = {keep_out};
  Restart();
  const double half_m = 0.5 * options_.hull_size_m.x();
  for (int i = 0; i < 300 && explorer_->state() != ExplorerState::kFinished; ++i) {
    const Plan* plan = Update(3);
    if (plan == nullptr) continue;
    for (const Waypoint& waypoint : plan->path)
      EXPECT_LT(waypoint.position_W_m.y() + half_m, 0.6 + 1e-9);
    Fly(plan->path);
  }
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
}

TEST_F(CoverageTest, ObeysNewRulesFromThenOn) {
  for (int i = 0; i < 5; ++i)
    if (const Plan* plan = Update(3)) Fly(plan->path);
  ExplorationOptions smaller = exploration_;
  smaller.max_m.x() = at_.position_W_m.x() + 0.3;
  explorer_->SetRules(options_, smaller);
  for (int i = 0; i < 300 && explorer_->state() != ExplorerState::kFinished; ++i) {
    const Plan* plan = Update(3);
    if (plan == nullptr) continue;
    EXPECT_LT(plan->path.back().position_W_m.x(), smaller.max_m.x() + 0.1);
    Fly(plan->path);
  }
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_TRUE(explorer_->is_home());
}

TEST_F(CoverageTest, EndsAsItIsTold) {
  for (int i = 0; i < 8; ++i)
    if (const Plan* plan = Update(3)) Fly(plan->path);
  explorer_->EndWith("go_home", true);
  EXPECT_EQ(explorer_->state(), ExplorerState::kReturning);
  FlyToTheEnd(50);
  EXPECT_EQ(explorer_->end_reason(), "go_home");
  EXPECT_TRUE(explorer_->is_home());
  Restart();
  Update();
  explorer_->EndWith("abort", false);
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->plan()->path.size(), 1u);
}

TEST_F(CoverageTest, DoesNotMoveBlindlyAroundTheStart) {
  // Nothing is known but what is seen from the start; a pole stands right behind.
  options_.bubble_radius_m = 1.4;
  const VoxelKey pole = truth_.grid().KeyOf(kStart.position_W_m - Vec3(0.7, 0, 0));
  truth_.Fill({{pole.x, pole.y, -6}, {pole.x, pole.y, 5}}, GridMap::kOccupied);
  Restart();
  double farthest_m = 0;
  for (int i = 0; i < 200 && explorer_->state() == ExplorerState::kExploring; ++i) {
    Look(truth_, sonar_, at_.X_WB(), known_);
    const Plan* plan = Update(1);
    if (plan == nullptr) continue;
    for (std::size_t leg = 0; leg + 1 < plan->path.size(); ++leg)
      EXPECT_TRUE(IsTrulyFree(plan->path[leg], plan->path[leg + 1])) << "plan " << plan->id;
    at_ = plan->path.back();
    farthest_m = std::max(farthest_m, ToStart_m());
  }
  EXPECT_GT(farthest_m, 3);
}

TEST_F(CoverageTest, ComesHomeAlongTheWayItCameWhereTheMapShowsNone) {
  for (int i = 0; i < 1000 && at_.position_W_m.x() < 1.5; ++i) Step();
  explorer_->EndWith("go_home", true);
  for (int i = 0; i < 1000 && explorer_->state() != ExplorerState::kFinished; ++i) {
    // Between the vehicle and its home no water is known, however often it was seen.
    known_.Fill({{-2, -12, -6}, {0, 11, 5}}, kUnknownLogOdds);
    Step();
  }
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_TRUE(explorer_->is_home());
}

TEST_F(CoverageTest, FliesNoseFirstWhereTheMapIsUncertain) {
  for (const bool is_uncertain : {false, true}) {
    // So little uncertainty that the clearances hardly grow.
    options_.max_uncertainty_m = 0.05;
    Restart();
    if (is_uncertain) known_.SetSigma(0.1);
    known_.SetAllUnsure(is_uncertain);
    int steps = 0, nose_first = 0;
    for (int i = 0; i < 150 && explorer_->state() == ExplorerState::kExploring; ++i) {
      const Plan* plan = Update(3);
      if (plan == nullptr) continue;
      for (std::size_t leg = 1; leg < plan->path.size(); ++leg) {
        const Waypoint &from = plan->path[leg - 1], &to = plan->path[leg];
        const Vec3 step_m = to.position_W_m - from.position_W_m;
        if (step_m.head<2>().norm() < 0.3) continue;
        const double ahead_rad = std::atan2(step_m.y(), step_m.x());
        ++steps;
        nose_first += std::abs(WrapAngle(from.yaw_rad - ahead_rad)) < 1e-9 &&
                      std::abs(WrapAngle(to.yaw_rad - ahead_rad)) < 1e-9;
      }
      Fly(plan->path);
    }
    EXPECT_GT(steps, 3) << is_uncertain;
    EXPECT_EQ(nose_first == steps, is_uncertain) << nose_first << " of " << steps;
  }
}

TEST_F(CoverageTest, KeepsLessDistanceWhereAllDistanceWallsItIn) {
  // Two rooms and a door of 1.6 m, which is closed to a vehicle that keeps 0.4 m more to each side.
  truth_.Fill({{4, -2, -6}, {6, 1, 5}}, GridMap::kFree);
  truth_.Fill({{-1, -12, -6}, {-1, 11, 5}}, GridMap::kOccupied);
  truth_.Fill({{-1, -5, -6}, {-1, 2, 5}}, GridMap::kFree);
  Restart();
  known_.SetSigma(0.2);
  bool went_through = false;
  for (int i = 0; i < 2000 && !went_through; ++i) {
    ASSERT_EQ(explorer_->state(), ExplorerState::kExploring);
    Step();
    went_through = at_.position_W_m.x() > 1;
  }
  EXPECT_TRUE(went_through);
}

TEST_F(CoverageTest, WaitsWhereWallsThatAreElsewhereHemItIn) {
  for (const double sigma_m : {0.0, 0.15}) {
    Restart();
    route_.clear();
    known_.SetSigma(sigma_m);
    known_.Fill(AroundStart(3), GridMap::kOccupied);
    known_.Fill(AroundStart(2), GridMap::kFree);
    for (int i = 0; i < 20; ++i) Update();
    EXPECT_EQ(explorer_->state() == ExplorerState::kFinished, sigma_m == 0);
    if (sigma_m == 0) continue;
    // The scans have shown where they are.
    ForEachVoxel(AroundStart(3), [&](const VoxelKey& key) { known_.Set(key, truth_.Get(key)); });
    FlyToTheEnd();
    EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
    EXPECT_LT(UnknownShare(), 0.1);
  }
}

TEST_F(CoverageTest, TurnsRoundWhereItIsHemmedIn) {
  known_.SetSigma(0.15);
  known_.Fill(AroundStart(4), GridMap::kOccupied);
  known_.Fill(AroundStart(3), GridMap::kFree);
  std::set<int> headings;
  for (int i = 0; i < 25; ++i) {
    const Plan* plan = Update(3);
    if (plan == nullptr) continue;
    at_ = plan->path.back();
    headings.insert(HeadingOfYaw(at_.yaw_rad));
  }
  EXPECT_EQ(explorer_->state(), ExplorerState::kExploring);
  EXPECT_GE(headings.size(), 8u) << "an eighth of a turn at a time, all round";
}

TEST_F(CoverageTest, FeelsItsWayHomeWhereWhatIsUncertainClosesAllWays) {
  double explored_m = 0, home_m = 0;
  for (int i = 0; i < 4000 && (explored_m < 7 || ToStart_m() < 1.5); ++i) {
    ASSERT_NE(explorer_->state(), ExplorerState::kFinished);
    const Waypoint from = at_;
    Step();
    explored_m += LengthOf(from, at_);
  }
  // No way home keeps so much clearance.
  options_.max_uncertainty_m = 1;
  known_.SetSigma(0.6);
  explorer_->SetRules(options_, exploration_);
  explorer_->EndWith("go_home", true);
  const double straight_m = ToStart_m();
  for (int i = 0; i < 4000 && explorer_->state() != ExplorerState::kFinished; ++i) {
    const Waypoint from = at_;
    Step();
    home_m += LengthOf(from, at_);
  }
  EXPECT_TRUE(explorer_->is_home());
  EXPECT_LT(home_m, 1.25 * straight_m) << "not all the way that it came";
}

TEST_F(CoverageTest, GivesUpAHomeThatCannotBeReached) {
  exploration_.home = HomePlace::kPlace;
  exploration_.home_m = {0, 0, 10};
  Restart();
  for (int i = 0; i < 5000 && explorer_->state() != ExplorerState::kFinished; ++i) Step();
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_FALSE(explorer_->is_home());
}

TEST_F(CoverageTest, WhatItHasTurnedPastDoesNotBlockATurn) {
  options_.hull_size_m = {0.9, 0.3, 0.4};
  options_.view_time_s = 20;  // Whatever is to be gained is gained in few views.
  sonar_ = NarrowSonar();
  Restart();
  known_ = GridMap(kChamberVoxel_m);
  ForEachVoxel(VoxelsOf(known_.grid(), {at_.position_W_m - Vec3::Constant(0.8),
                                        at_.position_W_m + Vec3::Constant(0.8)}),
               [&](const VoxelKey& key) { known_.Set(key, GridMap::kFree); });
  const Plan* plan = Update();
  ASSERT_NE(plan, nullptr);
  ASSERT_GE(plan->path.size(), 4u);
  const std::vector<Waypoint> path = plan->path;
  // Near its end it finds an obstacle where its bow has passed and its stern does not come.
  const Waypoint &from = path[path.size() - 2], &to = path.back();
  at_ = Interpolate(from, to, 0.7);
  const double side = WrapAngle(to.yaw_rad - from.yaw_rad) > 0 ? 1 : -1;
  const double passed_rad = at_.yaw_rad - side * std::numbers::pi / 2;
  known_.Set(known_.grid().KeyOf(at_.position_W_m +
                                 0.45 * Vec3(std::cos(passed_rad), std::sin(passed_rad), 0)),
             GridMap::kOccupied);
  const CollisionChecker checker = CollisionChecker(options_.collision_rules()).Scaled(0.5);
  bool would_block = false;
  for (std::size_t i = 2; i < path.size(); ++i)
    would_block |= !checker.IsEdgeFree(known_, path[i - 1], path[i]);
  ASSERT_TRUE(would_block);
  ASSERT_TRUE(checker.IsEdgeFree(known_, at_, to));
  EXPECT_EQ(Update(), nullptr);
}

TEST_F(CoverageTest, LeavesAPlaceThatItsClearancesConfineItTo) {
  // A dead end that the vehicle faces, too narrow to turn with all clearances.
  truth_.Fill({{-17, -12, -6}, {-6, -3, 5}}, GridMap::kOccupied);
  truth_.Fill({{-17, 3, -6}, {-6, 11, 5}}, GridMap::kOccupied);
  truth_.Fill({{-17, -2, -6}, {-15, 2, 5}}, GridMap::kOccupied);
  Restart();
  at_ = {{-2.2, 0.1, 0.1}, std::numbers::pi};
  explorer_->SetStart(at_.position_W_m);
  known_ = GridMap(kChamberVoxel_m);
  Look(truth_, sonar_, at_.X_WB(), known_);
  double most_x_m = at_.position_W_m.x();
  for (int i = 0; i < 200 && explorer_->state() == ExplorerState::kExploring; ++i) {
    Step();
    most_x_m = std::max(most_x_m, at_.position_W_m.x());
  }
  EXPECT_GT(most_x_m, 1);
}

// A map that moves, or a place that is known better, opens what was closed.
TEST_F(CoverageTest, LooksOnceMoreFromHome) {
  exploration_.home = HomePlace::kPlace;
  exploration_.home_m = {-2.5, 1.5, 0};  // Not where the exploration ends.
  Restart();
  const VoxelBox door = {{4, -20, -12}, {6, 20, 12}};
  int openings = 0, ends = 0;
  ExplorerState before = ExplorerState::kExploring;
  for (int i = 0; i < 600 && explorer_->state() != ExplorerState::kFinished; ++i) {
    const Plan* plan = Update(3);
    if (plan != nullptr) Fly(plan->path);
    const ExplorerState now = explorer_->state();
    ends += before == ExplorerState::kExploring && now != before;
    openings += before == ExplorerState::kReturning && now == ExplorerState::kExploring;
    before = now;
    if (ends == 0) known_.Fill(door, GridMap::kOccupied);
    if (ends == 1 && openings == 0) known_.Fill(door, GridMap::kFree);
  }
  EXPECT_GE(openings, 1);
  EXPECT_LE(openings, 3);
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_TRUE(explorer_->is_home());
  EXPECT_LT(UnknownShare(), 0.05);
}

TEST_F(CoverageTest, LooksAgainWhileItVisitsOldPlaces) {
  const VoxelBox door = {{4, -20, -12}, {6, 20, 12}};
  mission_.when_done = WhenDone::kRevisit;
  mission_.max_submaps = 40;
  Restart();
  int ends = 0;
  ExplorerState before = ExplorerState::kExploring;
  for (int i = 0; i < 600 && explorer_->state() != ExplorerState::kFinished; ++i) {
    submaps_ = i / 5;
    const Plan* plan = Update(3);
    if (plan != nullptr) Fly(plan->path);
    const ExplorerState now = explorer_->state();
    const bool is_end = before == ExplorerState::kExploring && now == ExplorerState::kRevisiting;
    ends += is_end;
    before = now;
    if (ends == 0) known_.Fill(door, GridMap::kOccupied);
    if (ends == 1 && is_end) known_.Fill(door, kUnknownLogOdds);
  }
  EXPECT_GE(ends, 2);
  EXPECT_LE(ends, 8);
  EXPECT_EQ(explorer_->end_reason(), "max_submaps");
  EXPECT_LT(UnknownShare(), 0.05);
}

TEST_F(CoverageTest, DoesNotLookForEverForWhatCannotBeSeen) {
  // A stretch of water that no scan ever clears.
  sonar_.tilt_rate_deg_s = 70;
  Restart();
  const VoxelBox murky = {{-8, 4, -3}, {-3, 9, 2}};
  for (int i = 0; i < 600 && explorer_->state() == ExplorerState::kExploring; ++i) {
    const Plan* plan = Update(3);
    if (plan != nullptr) Fly(plan->path);
    known_.Fill(murky, kUnknownLogOdds);
  }
  EXPECT_EQ(explorer_->end_reason(), "nothing_to_gain");
  EXPECT_GT(explorer_->unseen().in_vain, 20);
}

TEST_F(CoverageTest, EndsWhereThereIsNothing) {
  // In a box that the sonar cannot see into, all around unknown: what the bubble allows, then home.
  exploration_.min_m = {10, 10, 10};
  exploration_.max_m = {11, 11, 11};
  Restart();
  FlyToTheEnd();
  EXPECT_EQ(explorer_->state(), ExplorerState::kFinished);
  EXPECT_FALSE(explorer_->end_reason().empty());
}

}  // namespace
}  // namespace vog
