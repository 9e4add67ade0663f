#include "lib/planner/flown_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "lib/base/random.h"
#include "lib/occupancy/grid_map_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.2;

/// A hull twice as long as it is wide.
CollisionChecker Checker() {
  CollisionRules rules;
  rules.hull_size_m = {1.2, 0.6, 0.4};
  rules.clearance_m = 0.1;
  rules.unknown_clearance_m = 0;
  return CollisionChecker(rules);
}

GridMap Water() {
  GridMap map(kVoxel_m);
  map.Fill({{-20, -20, -10}, {19, 19, 9}}, GridMap::kFree);
  return map;
}

/// Water between two walls that are too near for a turn.
GridMap Lane() {
  GridMap map = Water();
  map.Fill({{-20, -20, -10}, {19, -4, 9}}, GridMap::kOccupied);
  map.Fill({{-20, 3, -10}, {19, 19, 9}}, GridMap::kOccupied);
  return map;
}

double AheadOf(const Waypoint& from, const Waypoint& to) {
  const Vec3 step_m = to.position_W_m - from.position_W_m;
  return std::atan2(step_m.y(), step_m.x());
}

const Waypoint kFrom{{-1, 0, 0}, 0}, kSideways{{-1, 1.5, 0}, 0}, kAhead{{1, 0, 0.5}, 0};

TEST(FlownStepTest, IsThePlannedOneThroughWaterThatIsSurelyKnown) {
  GridMap map = Water();
  const auto flown = [&] { return FlownStep(map, Checker(), kFrom, kFrom, kSideways); };
  for (const bool has_unsure_elsewhere : {false, true}) {
    if (has_unsure_elsewhere) map.SetUnsure({map.grid().KeyOf({3, 3, 0})});
    ASSERT_TRUE(flown().has_value());
    EXPECT_TRUE(IsSame(flown()->back(), kSideways));
  }
  map.SetUnsure({map.grid().KeyOf({-1, 1, 0})});
  ASSERT_TRUE(flown().has_value());
  EXPECT_NEAR(flown()->front().yaw_rad, AheadOf(kFrom, kSideways), 1e-9);
  EXPECT_NEAR(flown()->back().yaw_rad, AheadOf(kFrom, kSideways), 1e-9);
}

TEST(FlownStepTest, IsNoneWhereTheSonarCannotBeTurnedAhead) {
  GridMap map = Lane();
  const Waypoint backwards{kFrom.position_W_m, std::numbers::pi};
  for (const bool is_unsure : {false, true}) {
    map.SetAllUnsure(is_unsure);
    EXPECT_TRUE(FlownStep(map, Checker(), kFrom, kFrom, kAhead).has_value());
    const Waypoint goal{kAhead.position_W_m, backwards.yaw_rad};
    EXPECT_EQ(FlownStep(map, Checker(), backwards, backwards, goal).has_value(), !is_unsure);
  }
  // Up and down as planned.
  const Waypoint above{kFrom.position_W_m + Vec3(0.2, 0, 1), 0};
  EXPECT_TRUE(FlownStep(map, Checker(), kFrom, kFrom, above).has_value());
  // The part of a path that can be flown.
  const std::vector<Waypoint> there_and_back = {kFrom, kAhead, kFrom};
  EXPECT_TRUE(
      IsSame(FlownPath(map, Checker(), there_and_back, Refused::kEndsThePath).back(), kAhead));
  map.SetAllUnsure(false);
  EXPECT_TRUE(
      IsSame(FlownPath(map, Checker(), there_and_back, Refused::kEndsThePath).back(), kFrom));
}

TEST(FlownStepTest, IsFreeAndSeesWhereItGoes) {
  Random random(1, "flown step");
  int flown_steps = 0, sideways = 0, refused = 0;
  for (int i = 0; i < 300; ++i) {
    GridMap map = Water();
    const auto voxel = [&] {
      return map.grid().KeyOf(
          {random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-0.6, 0.6)});
    };
    for (int wall = 0; wall < 4; ++wall) map.Set(voxel(), GridMap::kOccupied);
    std::set<VoxelKey> unsure;
    for (int n = 0; n < 40; ++n) unsure.insert(voxel());
    map.SetUnsure(unsure);
    const auto place = [&] {
      return Waypoint{{random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-0.5, 0.5)},
                      random.Uniform(-3, 3)};
    };
    const Waypoint at = place(), to = place(), from{at.position_W_m, random.Uniform(-3, 3)};
    const auto flown = FlownStep(map, Checker(), at, from, to);
    if (!flown) {
      ++refused;
      continue;
    }
    std::vector<Waypoint> way = {at};
    way.insert(way.end(), flown->begin(), flown->end());
    for (std::size_t leg = 1; leg < way.size(); ++leg)
      EXPECT_TRUE(Checker().IsEdgeFree(map, way[leg - 1], way[leg])) << i;
    EXPECT_TRUE(Checker().IsEdgeFree(map, way.back(), to)) << "room to turn at its end, " << i;
    EXPECT_EQ(way.back().position_W_m, to.position_W_m);
    ++flown_steps;
    const bool is_short = (to.position_W_m - from.position_W_m).head<2>().norm() < 0.3;
    if (is_short || std::abs(WrapAngle(way.back().yaw_rad - AheadOf(from, to))) < 1e-9) continue;
    ++sideways;
    EXPECT_TRUE(Checker().IsSurelyKnown(map, from, to)) << i;
  }
  EXPECT_GT(flown_steps, 50);
  EXPECT_GT(sideways, 10);
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace vog
