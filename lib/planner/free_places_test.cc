#include "lib/planner/free_places.h"

#include <gtest/gtest.h>

#include <bit>

#include "lib/base/random.h"
#include "lib/occupancy/grid_map_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;
const Eigen::AlignedBox3d kBox(Vec3(-1.5, -1.2, -0.8), Vec3(1.5, 1.2, 0.8));

/// Free water with some occupied voxels and some that nobody has seen.
GridMap RandomMap(int seed) {
  GridMap map(kVoxel_m);
  Random random(static_cast<std::uint64_t>(seed), "map");
  map.Fill({{-30, -30, -30}, {29, 29, 29}}, GridMap::kFree);
  for (int i = 0; i < 40; ++i) {
    const VoxelKey key = {random.Index(36) - 18, random.Index(30) - 15, random.Index(24) - 12};
    map.Set(key, random.Chance(0.5) ? GridMap::kOccupied : kUnknownLogOdds);
  }
  return map;
}

CollisionRules SmallHull() {
  CollisionRules rules;
  rules.hull_size_m = {0.61, 0.43, 0.27};
  rules.clearance_m = 0.12;
  rules.unknown_clearance_m = 0.03;
  return rules;
}

TEST(FreePlacesTest, AgreesWithTheCheckerAtEachPlaceAndHeading) {
  const CollisionChecker checker(SmallHull());
  int free = 0, all = 0;
  for (int seed = 0; seed < 3; ++seed) {
    const GridMap map = RandomMap(seed);
    FreePlaces space(SmallHull(), kBox, 0.5);
    space.Update(map, checker);
    for (int place = 0; place < space.places(); ++place) {
      for (int heading = 0; heading < kHeadings; ++heading, ++all) {
        const bool fits = (space.HeadingsAt(place) >> heading & 1) != 0;
        free += fits;
        EXPECT_EQ(fits, checker.IsFree(map, {space.PositionOf(place), YawOfHeading(heading)}))
            << seed << ' ' << place << ' ' << heading;
      }
    }
  }
  EXPECT_GT(free, all / 20);
  EXPECT_LT(free, all * 19 / 20);
}

TEST(FreePlacesTest, FollowsTheMapAndTheVehicle) {
  GridMap map(kVoxel_m);
  CollisionChecker checker(SmallHull());
  FreePlaces space(SmallHull(), kBox, 0.5);
  space.Update(map, checker);
  const auto open = [&] {
    int places = 0;
    for (int place = 0; place < space.places(); ++place) places += space.HeadingsAt(place) != 0;
    return places;
  };
  EXPECT_EQ(open(), 0) << "unknown blocks";
  checker.SetBubble({Vec3::Zero(), 0.9});
  FreePlaces with_bubble(SmallHull(), kBox, 0.5);
  with_bubble.Update(map, checker);
  EXPECT_NE(with_bubble.HeadingsAt(with_bubble.PlacesAround(Vec3::Zero(), 0.3).front()), 0u);
  map.Fill({{-30, -30, -30}, {29, 29, 29}}, GridMap::kFree);
  space.Update(map, checker);
  EXPECT_EQ(open(), space.places());
  checker.SetKeepOut({Eigen::AlignedBox3d(Vec3(-5, -5, -5), Vec3(0, 5, 5))});
  space.Update(map, checker);
  for (int place = 0; place < space.places(); ++place) {
    if (space.HeadingsAt(place) != 0) {
      EXPECT_GT(space.PositionOf(place).x(), 0.2);
    }
  }
  EXPECT_LT(open(), space.places());
  EXPECT_GT(open(), 0);
}

TEST(FreePlacesTest, UncertaintyKeepsAway) {
  GridMap map(kVoxel_m);
  map.Fill({{-30, -30, -30}, {29, 29, 29}}, GridMap::kFree);
  map.Set({0, 0, 0}, GridMap::kOccupied);
  CollisionRules rules = SmallHull();
  rules.uncertainty_sigmas = 2;
  const auto nearest_m = [&] {
    FreePlaces space(rules, kBox, 0.1);
    space.Update(map, CollisionChecker(rules));
    double least_m = 10;
    for (int place = 0; place < space.places(); ++place) {
      const Vec3 p_W = space.PositionOf(place) - map.grid().CenterOf({0, 0, 0});
      if (space.HeadingsAt(place) != 0 && std::abs(p_W.z()) < 0.1)
        least_m = std::min(least_m, p_W.head<2>().norm());
    }
    return least_m;
  };
  const double sure_m = nearest_m();
  map.SetSigma(0.2);
  EXPECT_NEAR(nearest_m() - sure_m, 0.4, 0.12);
}

TEST(FreePlacesTest, NeighboursAreMutualAndNear) {
  const GridMap map = RandomMap(1);
  FreePlaces space(SmallHull(), kBox, 0.5);
  space.Update(map, CollisionChecker(SmallHull()));
  std::vector<int> neighbours, back;
  for (int place = 0; place < space.places(); ++place) {
    space.NeighboursOf(place, neighbours);
    EXPECT_LE(neighbours.size(), 18u);
    for (const int next : neighbours) {
      EXPECT_LT((space.PositionOf(next) - space.PositionOf(place)).norm(), 0.5 * 1.4143);
      space.NeighboursOf(next, back);
      EXPECT_NE(std::find(back.begin(), back.end(), place), back.end());
    }
  }
}

TEST(HeadingsTest, AnArcIsWhatOneTurnsThrough) {
  EXPECT_EQ(ArcAround(0b1110, 2), 0b1110u);
  EXPECT_EQ(ArcAround(0b11001110, 2), 0b1110u);
  EXPECT_EQ(ArcAround(0b1110, 5), 0u);
  EXPECT_EQ(ArcAround(kAllHeadings, 7), kAllHeadings);
  EXPECT_EQ(ArcAround(1u << 15 | 1u | 0b100, 0), 1u << 15 | 1u) << "across north";
}

TEST(HeadingsTest, NamesYawsAndTheNearest) {
  for (int heading = 0; heading < kHeadings; ++heading) {
    EXPECT_EQ(HeadingOfYaw(YawOfHeading(heading) + 0.15), heading);
    EXPECT_EQ(HeadingOfYaw(YawOfHeading(heading) - 0.15), heading);
    EXPECT_EQ(NearestHeading(kAllHeadings, YawOfHeading(heading)), heading);
  }
  EXPECT_EQ(NearestHeading(0b1001, YawOfHeading(2)), 3);
  EXPECT_EQ(NearestHeading(0b1001, YawOfHeading(15)), 0);
}

}  // namespace
}  // namespace vog
