#include "lib/planner/coverage_planner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

class CoveragePlannerTest : public testing::Test {
 protected:
  ViewPlan Plan(const GridMap& map, const Waypoint& at) {
    checker_.SetPresence(at, kChamberVoxel_m);
    return planner_.Plan(map, checker_, at);
  }

  PlannerOptions options_ = SmallPlanner();
  CollisionChecker checker_{options_.collision_rules()};
  CoveragePlanner planner_{options_, MotionLimits{0.25, 0.15}, NarrowSonar(), ChamberBox(), 1};
};

TEST_F(CoveragePlannerTest, TurnsOnAsLongAsThereIsMoreToSee) {
  options_.view_time_s = 20;
  CoveragePlanner planner(options_, MotionLimits{0.25, 0.15}, NarrowSonar(), ChamberBox(), 1);
  // All is unknown but the water around it.
  GridMap map(kChamberVoxel_m);
  map.Fill({{-4, -4, -4}, {4, 4, 4}}, GridMap::kFree);
  const Waypoint at{{0.1, 0.1, 0.1}, 0.3};
  checker_.SetPresence(at, kChamberVoxel_m);
  const ViewPlan plan = planner.Plan(map, checker_, at);
  ASSERT_EQ(plan.outcome, ViewPlan::Outcome::kGo);
  ASSERT_GE(plan.path.size(), 3u);
  double turned_rad = 0;
  for (std::size_t i = 2; i < plan.path.size(); ++i) {
    const double turn_rad = WrapAngle(plan.path[i].yaw_rad - plan.path[i - 1].yaw_rad);
    EXPECT_LT(LengthOf(plan.path[i - 1], plan.path[i]), 1e-9) << "on the spot";
    EXPECT_LE(std::abs(turn_rad), std::numbers::pi / 2 + 1e-9) << "clear which way round";
    EXPECT_GT(turn_rad * WrapAngle(plan.path[2].yaw_rad - plan.path[1].yaw_rad), 0);
    EXPECT_TRUE(checker_.IsEdgeFree(map, plan.path[i - 1], plan.path[i]));
    turned_rad += std::abs(turn_rad);
  }
  EXPECT_GT(turned_rad, std::numbers::pi) << "more than a single view";
  EXPECT_LT(turned_rad, 2 * std::numbers::pi);
}

TEST_F(CoveragePlannerTest, DoesNotTurnOverWhatIsKnown) {
  GridMap map = Chamber();
  map.Fill({{-17, 6, -6}, {-8, 11, 5}}, kUnknownLogOdds);
  const ViewPlan plan = Plan(map, {{-2, -1.5, 0.1}, 0});
  ASSERT_EQ(plan.outcome, ViewPlan::Outcome::kGo);
  for (std::size_t i = 2; i < plan.path.size(); ++i)
    EXPECT_LE(std::abs(WrapAngle(plan.path[i].yaw_rad - plan.path[1].yaw_rad)), 1.6);
}

TEST_F(CoveragePlannerTest, LooksThroughGapsInTheEnd) {
  // A wall with a hole too small for the hull; beside the hole what is behind is unknown.
  GridMap map = Chamber();
  map.Fill({{4, -12, -6}, {4, 11, 5}}, GridMap::kOccupied);
  map.Fill({{5, -12, -6}, {16, 11, 5}}, kUnknownLogOdds);
  map.Set({4, 5, 0}, GridMap::kFree);
  ViewPlan plan;
  int plans = 0;
  do {
    plan = Plan(map, {{-2, -1.5, 0.1}, 0});
  } while (plan.outcome == ViewPlan::Outcome::kLookOn && ++plans < 100);
  ASSERT_EQ(plan.outcome, ViewPlan::Outcome::kGo);
  const Vec3 to_hole = map.grid().CenterOf({4, 5, 0}) - plan.tree.back().at.position_W_m;
  EXPECT_LT(std::abs(WrapAngle(std::atan2(to_hole.y(), to_hole.x()) - plan.tree.back().at.yaw_rad)),
            ToRadians(NarrowSonar().fov_deg));
}

TEST_F(CoveragePlannerTest, SearchesEachPlaceOnceBeforeItEnds) {
  // What is left is too little to count, but a rough look from anywhere promises more.
  GridMap map = Chamber();
  for (const int x : {-12, -1, 12})
    for (const int y : {-15, 12}) map.Fill({{x - 1, y, -1}, {x + 1, y + 2, 1}}, kUnknownLogOdds);
  for (const int x : {-20, 17}) map.Fill({{x, -1, -1}, {x + 2, 1, 1}}, kUnknownLogOdds);
  const Waypoint at{{-2, -1.5, 0.1}, 0};
  Routes routes(options_, MotionLimits{0.25, 0.15}, ChamberBox());
  routes.Search(map, checker_, at);
  const auto places = static_cast<int>(routes.reached().size());
  ASSERT_GT(places, 300);
  int plans = 1;
  ViewPlan plan = Plan(map, at);
  for (; plan.outcome == ViewPlan::Outcome::kLookOn; plan = Plan(map, at)) ASSERT_LT(++plans, 1000);
  EXPECT_EQ(plan.outcome, ViewPlan::Outcome::kNothing);
  // Fifty looks a plan, few places looked at twice, and a tree of which ten views come in a plan.
  EXPECT_LT(plans, 1.6 * places / 50 + options_.max_tree_nodes / 10 + 2);
}

TEST_F(CoveragePlannerTest, LooksFromNewPlacesWhileItFlies) {
  // What is left is behind a wall with a door, far from here.
  GridMap map = Chamber();
  map.Fill({{4, -12, -6}, {4, 11, 5}}, GridMap::kOccupied);
  map.Fill({{4, 3, -4}, {4, 10, 3}}, GridMap::kFree);
  map.Fill({{8, -12, -6}, {16, -7, 5}}, kUnknownLogOdds);
  const Waypoint at{{-2, -1.5, 0.1}, 0};
  ASSERT_EQ(Plan(map, at).outcome, ViewPlan::Outcome::kLookOn) << "most places are still new";
  for (int second = 0; second < 60; ++second) planner_.Look(map, at);
  const ViewPlan plan = Plan(map, at);
  ASSERT_EQ(plan.outcome, ViewPlan::Outcome::kGo);
  EXPECT_GT(plan.tree.back().at.position_W_m.x(), 0.9);
}

TEST_F(CoveragePlannerTest, SaysWhenItsClearancesConfineIt) {
  // As wide as the hull with its clearances, not as its diagonal, and short.
  GridMap map = Chamber();
  map.Fill({{-17, -12, -6}, {16, -3, 5}}, GridMap::kOccupied);
  map.Fill({{-17, 3, -6}, {16, 11, 5}}, GridMap::kOccupied);
  map.Fill({{-8, -12, -6}, {16, 11, 5}}, GridMap::kOccupied);
  map.Fill({{-17, -12, -6}, {16, 11, -3}}, GridMap::kOccupied);
  map.Fill({{-17, -12, 3}, {16, 11, 5}}, GridMap::kOccupied);
  const Waypoint at{{-2.5, 0.1, 0.1}, 0};
  EXPECT_TRUE(Plan(map, at).is_confined);
  EXPECT_FALSE(Plan(Chamber(), at).is_confined);
}

}  // namespace
}  // namespace vog
