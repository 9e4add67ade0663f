#include "lib/planner/routes.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

class RoutesTest : public testing::Test {
 protected:
  void Search(const GridMap& map, const Waypoint& at) {
    CollisionChecker checker(options_.collision_rules());
    checker.SetPresence(at, kChamberVoxel_m);
    checker_ = checker;
    routes_.Search(map, *checker_, at);
  }

  PlannerOptions options_ = SmallPlanner();
  MotionLimits limits_{0.25, 0.15};
  Routes routes_{options_, limits_, ChamberBox()};
  std::optional<CollisionChecker> checker_;
  const Waypoint at_{{-2, 1, 0}, 0.4};
};

TEST_F(RoutesTest, LeadWhereTheWholeWayIsFree) {
  const GridMap map = Chamber();
  Search(map, at_);
  ASSERT_GT(routes_.reached().size(), 100u);
  int routes = 0, behind_the_pillar = 0;
  for (int index = 0; index < static_cast<int>(routes_.reached().size()); index += 7) {
    const Reached reached = routes_.reached()[static_cast<std::size_t>(index)];
    const Vec3 p_W = routes_.PositionOf(reached);
    const int heading = NearestHeading(reached.arc, 2.0);
    const auto way = routes_.RouteTo(map, *checker_, index, YawOfHeading(heading));
    if (!way) continue;  // The search was done anew: numbers mean something else.
    ++routes;
    behind_the_pillar += p_W.x() > 1.2;
    EXPECT_EQ(way->front().position_W_m, at_.position_W_m);
    EXPECT_EQ(way->back().position_W_m, p_W);
    EXPECT_NEAR(WrapAngle(way->back().yaw_rad - YawOfHeading(heading)), 0, 1e-9);
    double length_m = 0;
    for (std::size_t i = 0; i + 1 < way->size(); ++i) {
      length_m += LengthOf((*way)[i], (*way)[i + 1]);
      EXPECT_TRUE(checker_->IsEdgeFree(map, (*way)[i], (*way)[i + 1]));
    }
    EXPECT_LE(length_m, limits_.max_speed_m_s * reached.time_s + 1e-6) << "straightened";
    EXPECT_GE(reached.time_s, (p_W - at_.position_W_m).norm() / limits_.max_speed_m_s - 1e-9);
  }
  EXPECT_GT(routes, 10);
  EXPECT_GT(behind_the_pillar, 0);
}

TEST_F(RoutesTest, AWayOfNoLengthIsATurn) {
  // The vehicle stands on a place of the lattice.
  const GridMap map = Chamber();
  Search(map, at_);
  const Waypoint on{routes_.PositionOf(routes_.reached()[1]), 0.4};
  Search(map, on);
  for (int i = 0; i < 2; ++i) {
    ASSERT_LT((routes_.PositionOf(routes_.reached()[static_cast<std::size_t>(i)]) - on.position_W_m)
                  .norm(),
              1e-6);
    const auto way = routes_.RouteTo(map, *checker_, i, YawOfHeading(4));
    ASSERT_TRUE(way);
    for (const Waypoint& waypoint : *way) EXPECT_TRUE(std::isfinite(waypoint.yaw_rad));
    EXPECT_NEAR(way->back().yaw_rad, YawOfHeading(4), 1e-9);
  }
}

TEST_F(RoutesTest, APlaceWhereTheTurnIsRefusedIsLeftOutForAWhile) {
  const GridMap map = Chamber();
  Search(map, at_);
  const int index = static_cast<int>(routes_.reached().size()) - 1;
  const int place = routes_.reached()[static_cast<std::size_t>(index)].place;
  routes_.RefuseTurnAt(index);
  for (const Reached& reached : routes_.reached()) EXPECT_NE(reached.place, place);
  Search(map, at_);
  for (const Reached& reached : routes_.reached()) EXPECT_NE(reached.place, place);
  for (int i = 0; i < 10; ++i) Search(map, at_);
  bool is_back = false;
  for (const Reached& reached : routes_.reached()) is_back |= reached.place == place;
  EXPECT_TRUE(is_back);
  routes_.RefuseTurnAt(0);
  EXPECT_EQ(std::popcount(routes_.reached().front().arc), 1) << "where it stands it stays";
}

TEST_F(RoutesTest, EndAtWalls) {
  GridMap map = Chamber();
  map.Fill({{-1, -12, -6}, {-1, 11, 5}}, GridMap::kOccupied);
  Search(map, at_);
  ASSERT_GT(routes_.reached().size(), 20u);
  for (const Reached& reached : routes_.reached())
    EXPECT_LT(routes_.PositionOf(reached).x(), -0.2 - 0.5 * options_.hull_size_m.x());
  EXPECT_FALSE(routes_.ReachedNear({2, 1, 0}, 0.5));
  EXPECT_TRUE(routes_.ReachedNear({-2, -1, 0}, 0.5));
}

TEST_F(RoutesTest, NearestFirst) {
  Search(Chamber(), at_);
  for (std::size_t i = 1; i < routes_.reached().size(); ++i)
    EXPECT_GE(routes_.reached()[i].time_s, routes_.reached()[i - 1].time_s - 1e-9);
}

TEST_F(RoutesTest, InANarrowPassageTheHullKeepsItsHeading) {
  // A gap as wide as the hull is not long: 0.6 m and clearances fit, its diagonal does not.
  options_.hull_size_m = {0.9, 0.3, 0.4};
  routes_ = Routes(options_, limits_, ChamberBox());
  GridMap map = Chamber();
  map.Fill({{-3, -12, -6}, {1, -4, 5}}, GridMap::kOccupied);
  map.Fill({{-3, 1, -6}, {1, 11, 5}}, GridMap::kOccupied);
  Search(map, {{-2, -0.3, 0}, 0});
  ASSERT_TRUE(routes_.ReachedNear({0.1, -0.2, 0}, 0.4));
  bool is_narrow = false;
  for (const Reached& reached : routes_.reached())
    is_narrow |= reached.arc != kAllHeadings && std::abs(routes_.PositionOf(reached).x()) < 0.5;
  EXPECT_TRUE(is_narrow);
}

}  // namespace
}  // namespace vog
