#include "lib/collision/collision_checker.h"

#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "lib/base/random.h"
#include "lib/occupancy/grid_map_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.2;

Waypoint RandomWaypoint(Random& random, double reach_m = 1.5) {
  return {{random.Uniform(-reach_m, reach_m), random.Uniform(-reach_m, reach_m),
           random.Uniform(-reach_m, reach_m)},
          random.Uniform(-std::numbers::pi, std::numbers::pi)};
}

/// A free block of space with occupied and unknown voxels strewn in.
GridMap RandomMap(double occupied_share, double unknown_share, Random& random) {
  GridMap map(kVoxel_m);
  map.Fill({{-20, -20, -20}, {20, 20, 20}}, GridMap::kFree);
  ForEachVoxel({{-14, -14, -14}, {14, 14, 14}}, [&](const VoxelKey& key) {
    if (random.Chance(occupied_share)) map.Set(key, GridMap::kOccupied);
    if (random.Chance(unknown_share)) map.Set(key, kUnknownLogOdds);
  });
  return map;
}

/// Whether two boxes, the first turned about z, have a point in common; by the separating axis
/// theorem, positive for a gap [m].
double GapBetween(const Waypoint& at, const Vec3& half_m, const Vec3& center_W, double side_m) {
  const Pose3 X_BW = at.X_WB().inverse();
  const Vec3 c = X_BW * center_W;
  const Mat3 R = X_BW.linear();
  const double h = side_m / 2;
  double gap = std::abs(c.z()) - half_m.z() - h;
  for (int axis = 0; axis < 2; ++axis) {
    gap = std::max(
        gap, std::abs(c[axis]) - half_m[axis] - h * (std::abs(R(axis, 0)) + std::abs(R(axis, 1))));
    const Vec3 a = R.col(axis);
    gap = std::max(
        gap, std::abs(a.dot(c)) - h - half_m.x() * std::abs(a.x()) - half_m.y() * std::abs(a.y()));
  }
  return gap;
}

/// All that the checker may be told.
struct Situation {
  CollisionRules rules;
  FreeBubble bubble;
  std::optional<Waypoint> presence;
  double presence_margin_m = 0;
  CollisionChecker::Presence covers = CollisionChecker::Presence::kCoversUnknown;

  CollisionChecker Checker() const {
    CollisionChecker checker(rules);
    checker.SetBubble(bubble);
    if (presence) checker.SetPresence(*presence, presence_margin_m, covers);
    return checker;
  }

  bool IsPresent(const Vec3& p_W) const {
    if (!presence) return false;
    const Vec3 p_P = presence->X_WB().inverse() * p_W;
    return ((p_P.cwiseAbs() - rules.hull_size_m / 2).array() < presence_margin_m).all();
  }

  /// A voxel that matters, and half the hull that may not touch it.
  struct Obstacle {
    Vec3 center_W, half_m;
  };
  std::vector<Obstacle> ObstaclesOf(const GridMap& map) const {
    std::vector<Obstacle> obstacles;
    ForEachVoxel({{-20, -20, -20}, {20, 20, 20}}, [&](const VoxelKey& key) {
      const VoxelState state = map.StateOf(map.Get(key));
      if (state == VoxelState::kFree) return;
      const Vec3 center_W = map.grid().CenterOf(key);
      Vec3 half_m = rules.hull_size_m / 2;
      if (state == VoxelState::kOccupied) {
        if (covers == CollisionChecker::Presence::kCoversOccupied && IsPresent(center_W)) return;
        const double uncertain_m =
            std::min(rules.max_uncertainty_m, rules.uncertainty_sigmas * map.SigmaAt(key));
        half_m += Vec3::Constant(rules.clearance_m) + Vec3(uncertain_m, uncertain_m, 0);
      } else {
        if (!rules.unknown_blocks || IsPresent(center_W)) return;
        if ((center_W - bubble.center_W_m).norm() < bubble.radius_m) return;
        half_m += Vec3::Constant(rules.unknown_clearance_m);
      }
      obstacles.push_back({center_W, half_m});
    });
    return obstacles;
  }
};

/// The smallest gap to any voxel that matters, each tried.
double LeastGap(const std::vector<Situation::Obstacle>& obstacles, const Waypoint& at) {
  double least_m = 1e9;
  for (const auto& [center_W, half_m] : obstacles)
    least_m = std::min(least_m, GapBetween(at, half_m, center_W, kVoxel_m));
  return least_m;
}

Situation RandomSituation(Random& random) {
  Situation s;
  s.rules.hull_size_m = Vec3(random.Uniform(0.4, 1.2), random.Uniform(0.4, 1.2), 0.5);
  s.rules.clearance_m = random.Uniform(0, 0.2);
  s.rules.unknown_clearance_m = random.Uniform(0, 0.2);
  s.rules.unknown_blocks = random.Chance(0.7);
  s.rules.uncertainty_sigmas = random.Chance(0.5) ? 2 : 0;
  s.rules.max_uncertainty_m = 0.3;
  if (random.Chance(0.5)) s.bubble = {RandomWaypoint(random).position_W_m, 1.2};
  if (random.Chance(0.5)) {
    s.presence = RandomWaypoint(random, 0.7);
    s.presence_margin_m = random.Uniform(0, 0.2);
    if (random.Chance(0.5)) s.covers = CollisionChecker::Presence::kCoversOccupied;
  }
  return s;
}

TEST(FreeBubbleTest, BeyondItsCoreOnlyWhatWasLookedInto) {
  FreeBubble bubble;
  bubble.center_W_m = {1, 2, 3};
  bubble.radius_m = 1.2;
  const auto at = [&](double yaw_deg, double away_m, double up_m = 0) {
    return Vec3(bubble.center_W_m + Vec3(away_m * std::cos(ToRadians(yaw_deg)),
                                         away_m * std::sin(ToRadians(yaw_deg)), up_m));
  };
  for (const double yaw_deg : {-179.0, -90.0, -1.0, 1.0, 44.0, 179.0}) {
    EXPECT_TRUE(bubble.Holds(at(yaw_deg, 1.19)));
    EXPECT_FALSE(bubble.Holds(at(yaw_deg, 1.21)));
    EXPECT_FALSE(bubble.Holds(at(yaw_deg, 0.9, 0.9)));
  }
  bubble.core_radius_m = 0.8;
  bubble.LookInto(ToRadians(41), ToRadians(3));  // Of the sectors, that from 40 to 45 degrees.
  EXPECT_EQ(bubble.looked.count(), 1u);
  EXPECT_TRUE(bubble.Holds(at(44, 1.19)));
  EXPECT_TRUE(bubble.Holds(at(41, 0.9, -0.5)));
  EXPECT_FALSE(bubble.Holds(at(44, 1.21)));
  for (const double yaw_deg : {-179.0, -90.0, -1.0, 1.0, 39.0, 46.0, 179.0}) {
    EXPECT_FALSE(bubble.Holds(at(yaw_deg, 0.81)));
    EXPECT_TRUE(bubble.Holds(at(yaw_deg, 0.79, -0.6)));
  }
}

TEST(CollisionCheckerTest, AgreesWithEveryVoxelTriedByHand) {
  Random random(1, "collision");
  int free = 0, blocked = 0;
  for (int i = 0; i < 25; ++i) {
    GridMap map = RandomMap(random.Uniform(0, 0.004), random.Uniform(0, 0.006), random);
    map.SetSigmas([&] { return random.Uniform(0, 0.1); });
    const Situation s = RandomSituation(random);
    const CollisionChecker dut = s.Checker();
    const auto obstacles = s.ObstaclesOf(map);
    for (int k = 0; k < 12; ++k) {
      const Waypoint at = RandomWaypoint(random);
      const double gap_m = LeastGap(obstacles, at);
      if (std::abs(gap_m) < 1e-4) continue;  // Touching to rounding.
      EXPECT_EQ(dut.IsFree(map, at), gap_m > 0) << i << " " << k << " " << gap_m;
      ++(gap_m > 0 ? free : blocked);
    }
  }
  EXPECT_GT(free, 40);
  EXPECT_GT(blocked, 40);
}

TEST(CollisionCheckerTest, UnknownSpaceBlocksOnlyWhereItShall) {
  GridMap map(kVoxel_m);
  Situation s;
  const Waypoint at;
  EXPECT_FALSE(s.Checker().IsFree(map, at));
  s.rules.unknown_blocks = false;
  EXPECT_TRUE(s.Checker().IsFree(map, at));
  s.rules.unknown_blocks = true;
  s.bubble.radius_m = 1.2;
  EXPECT_TRUE(s.Checker().IsFree(map, at));
  EXPECT_FALSE(s.Checker().IsFree(map, {{1, 0, 0}, 0}));
  s.bubble.radius_m = 0;
  s.presence = at;
  s.presence_margin_m = kVoxel_m;
  EXPECT_TRUE(s.Checker().IsFree(map, at));
  EXPECT_FALSE(s.Checker().IsFree(map, {{0.3, 0, 0}, 0}));
  map.Set({0, 0, 0}, GridMap::kOccupied);
  EXPECT_FALSE(s.Checker().IsFree(map, at));
  s.covers = CollisionChecker::Presence::kCoversOccupied;
  EXPECT_TRUE(s.Checker().IsFree(map, at));
}

TEST(CollisionCheckerTest, EdgesAreSweptWithoutAGap) {
  Random random(2, "collision");
  int free = 0, blocked = 0;
  for (int i = 0; i < 12; ++i) {
    const GridMap map = RandomMap(0.0008, 0, random);
    const Situation s = RandomSituation(random);
    const CollisionChecker dut = s.Checker();
    const auto obstacles = s.ObstaclesOf(map);
    for (int k = 0; k < 4; ++k) {
      const Waypoint from = RandomWaypoint(random), to = RandomWaypoint(random);
      // Many more places than the checker looks at.
      constexpr int kSteps = 120;
      double least_m = 1e9, first_hit = 1;
      for (int step = 0; step <= kSteps; ++step) {
        const double fraction = step / static_cast<double>(kSteps);
        const double gap_m = LeastGap(obstacles, Interpolate(from, to, fraction));
        if (gap_m < 0 && least_m > 0) first_hit = fraction;
        least_m = std::min(least_m, gap_m);
      }
      const bool is_free = dut.IsEdgeFree(map, from, to);
      const double fraction = dut.FreeFractionOf(map, from, to);
      EXPECT_EQ(is_free, fraction == 1);
      ++(is_free ? free : blocked);
      // Between two samples a corner moves half a voxel at most.
      if (least_m > 1e-3) {
        EXPECT_TRUE(is_free) << i << " " << k;
      }
      if (least_m < -kVoxel_m / 2) {
        EXPECT_FALSE(is_free) << i << " " << k << " " << least_m;
      }
      if (is_free) continue;
      EXPECT_LE(fraction, first_hit + 0.1);
      if (fraction > 0) {
        EXPECT_GT(LeastGap(obstacles, Interpolate(from, to, fraction)), -1e-4);
      }
    }
  }
  EXPECT_GT(free, 5);
  EXPECT_GT(blocked, 5);
}

TEST(CollisionCheckerTest, AWallInTheWayEndsTheFreePart) {
  GridMap map(0.1);
  map.Fill({{-15, -15, -10}, {65, 15, 10}}, GridMap::kFree);
  map.Fill({{30, -15, -10}, {30, 15, 10}}, GridMap::kOccupied);  // x from 3.0 to 3.1.
  CollisionRules rules;
  rules.clearance_m = 0.1;
  const CollisionChecker dut(rules);
  // The hull's front is 0.5 m ahead and keeps 0.1 m.
  const double fraction = dut.FreeFractionOf(map, {}, {{4, 0, 0}, 0});
  EXPECT_LE(4 * fraction, 2.4);
  EXPECT_GE(4 * fraction, 2.4 - 2 * 0.05);
  EXPECT_TRUE(dut.IsEdgeFree(map, {}, {{2.39, 0, 0}, 0}));
  EXPECT_NEAR(dut.FreeFractionOf(map, {{4, 0, 0}, 0}, {{3, 0, 0}, 0}), 0.25, 0.05);
  EXPECT_EQ(dut.FreeFractionOf(map, {{3, 0, 0}, 0}, {{5, 0, 0}, 0}), 0) << "starts inside";
}

TEST(CollisionCheckerTest, ATurnSweepsItsCorners) {
  GridMap map(0.1);
  map.Fill({{-15, -15, -10}, {15, 15, 10}}, GridMap::kFree);
  map.Set({6, 0, 0}, GridMap::kOccupied);  // Beyond the side at 0.5 m, within the corner at 0.71.
  CollisionRules rules;
  rules.clearance_m = 0;
  const CollisionChecker dut(rules);
  EXPECT_TRUE(dut.IsFree(map, {}));
  EXPECT_TRUE(dut.IsFree(map, {Vec3::Zero(), std::numbers::pi / 2}));
  EXPECT_FALSE(dut.IsEdgeFree(map, {}, {Vec3::Zero(), std::numbers::pi / 2}));
}

TEST(CollisionCheckerTest, ScaledShrinksAllClearances) {
  CollisionRules rules;
  rules.clearance_m = 0.4;
  rules.unknown_clearance_m = 0.2;
  rules.uncertainty_sigmas = 2;
  const CollisionRules half = CollisionChecker(rules).Scaled(0.5).rules();
  EXPECT_EQ(half.clearance_m, 0.2);
  EXPECT_EQ(half.unknown_clearance_m, 0.1);
  EXPECT_EQ(half.uncertainty_sigmas, 1);
  EXPECT_EQ(half.hull_size_m, rules.hull_size_m);
  const CollisionRules bare = CollisionChecker(rules).Scaled(0).rules();
  EXPECT_EQ(bare.clearance_m, 0);
}

TEST(CollisionCheckerTest, WhatIsNotSurelyThereBlocksTheBareHullAlone) {
  CollisionRules rules;
  rules.hull_size_m = {1, 1, 0.5};
  rules.clearance_m = 0.15;
  rules.uncertainty_sigmas = 2;
  rules.unknown_blocks = false;
  const CollisionChecker all(rules), sure = all.ForSure(0.25, 0), half = all.ForSure(0.25, 0.5),
                                     growing_not = all.GrowingBy(0);
  const Waypoint at{{0, 0, 0}, 0};
  for (const double sigma_m : {0.2, 0.3})
    for (const double beside_m : {0.4, 0.65, 0.85, 1.6}) {
      GridMap map(0.1);
      map.Set(map.grid().KeyOf({beside_m, 0.05, 0.05}), GridMap::kOccupied);
      map.SetSigma(sigma_m);
      const bool touches_hull = beside_m < 0.5, touches_clearance = beside_m < 1;
      EXPECT_EQ(all.IsFree(map, at), !touches_clearance) << sigma_m << " " << beside_m;
      EXPECT_EQ(sure.IsFree(map, at), sigma_m > 0.25 ? !touches_hull : !touches_clearance)
          << sigma_m << " " << beside_m;
      EXPECT_EQ(half.IsFree(map, at), sigma_m > 0.25 ? beside_m > 0.85 : !touches_clearance)
          << sigma_m << " " << beside_m;
      EXPECT_EQ(growing_not.IsFree(map, at), beside_m > 0.7) << sigma_m << " " << beside_m;
    }
}

// The map shows a wall nearer to the vehicle than its clearance, and it has to get out of there.
TEST(CollisionCheckerTest, WhatIsTooNearMayNotGetNearer) {
  CollisionRules rules;
  rules.hull_size_m = {1, 1, 0.5};
  rules.clearance_m = 0.4;
  rules.unknown_blocks = false;
  GridMap map(0.1);
  map.Set(map.grid().KeyOf({0.75, 0.05, 0.05}), GridMap::kOccupied);
  map.Set(map.grid().KeyOf({-2.05, 0.05, 0.05}), GridMap::kOccupied);
  const Waypoint at{{0, 0, 0}, 0};
  CollisionChecker dut(rules);
  dut.SetPresence(at, 0.1);
  EXPECT_FALSE(dut.IsFree(map, at));
  dut.SetPresence(at, 0.1, CollisionChecker::Presence::kCoversOccupied);
  for (const auto& [x_m, is_free] :
       {std::pair(0.0, true), std::pair(0.05, false), std::pair(-0.5, true), std::pair(-0.95, true),
        std::pair(-1.2, false)})  // Toward the other one.
    EXPECT_EQ(dut.IsFree(map, {{x_m, 0, 0}, 0}), is_free) << x_m;
  EXPECT_TRUE(dut.IsEdgeFree(map, at, {{-0.9, 0, 0}, 0}));
  EXPECT_FALSE(dut.IsFree(map, {{0, 0, 0}, 0.8})) << "a corner";
  EXPECT_FALSE(dut.IsFree(map, {{0.25, 0, 0}, 0})) << "inside";
}

TEST(CollisionCheckerTest, TellsWhetherAllOnAWayIsSurelyKnown) {
  CollisionRules rules;
  rules.hull_size_m = {1, 1, 0.5};
  CollisionChecker dut(rules);
  const Waypoint from{{0, 0, 0}, 0}, to{{2, 0, 0}, 0};
  for (const auto& [unsure_W, is_passed] :
       {std::pair(Vec3(1.05, 0.45, 0.15), true), std::pair(Vec3(2.35, -0.35, -0.15), true),
        std::pair(Vec3(1.05, 0.65, 0.05), false), std::pair(Vec3(1.05, 0.05, 0.35), false),
        std::pair(Vec3(0.05, 0.05, 0.05), true)}) {
    GridMap map(0.1);
    map.SetUnsure({map.grid().KeyOf(unsure_W)});
    EXPECT_EQ(dut.IsSurelyKnown(map, from, to), !is_passed) << unsure_W.transpose();
  }
  // Where the vehicle is, it need not have looked.
  GridMap map(0.1);
  map.SetUnsure({map.grid().KeyOf({0.05, 0.05, 0.05})});
  dut.SetPresence(from, 0.1);
  EXPECT_TRUE(dut.IsSurelyKnown(map, from, to));
}

TEST(CollisionCheckerTest, MayPassUnknownWater) {
  const CollisionChecker dut{CollisionRules{}};
  GridMap map(0.1);
  EXPECT_FALSE(dut.IsFree(map, {}));
  EXPECT_TRUE(dut.PassingUnknown().IsFree(map, {}));
  map.Set(map.grid().KeyOf({0.45, 0, 0}), GridMap::kOccupied);
  EXPECT_FALSE(dut.PassingUnknown().IsFree(map, {}));
}

}  // namespace
}  // namespace vog
