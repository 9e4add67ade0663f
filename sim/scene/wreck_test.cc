#include "sim/scene/wreck.h"

#include <gtest/gtest.h>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/overlap.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

constexpr std::size_t kParts = 6;  // Shell, deck, stem, deckhouse, mast, floor.

/// Upright, with nothing but the break open.
WreckOptions Upright() {
  WreckOptions options;
  options.list_deg = options.trim_deg = 0;
  options.hatches = options.breaches = options.holes = 0;
  return options;
}

bool TouchesVehicle(const TriangleMesh& mesh, const Vec3& p_W) {
  return BoxTouches(mesh, MakePose(p_W), {1, 1, 0.5});
}

/// Rays from starboard to port, or back, on a lattice over the ship's side: the share of those that
/// get farther than the shell of the near side.
double ShareThatEnters(const TriangleMesh& mesh, double side) {
  const RayCaster caster(mesh);
  int rays = 0, entered = 0;
  for (double x = -3.4; x < 2; x += 0.05)
    for (double z = -0.5; z < 0.8; z += 0.05) {
      const auto hit = caster.Cast({x, side * 5, z}, {0, -side, 0}, 10);
      ++rays;
      entered += !hit || hit->range_m > 4;
    }
  return static_cast<double>(entered) / rays;
}

TEST(WreckTest, PartsAreClosedShellsThatPointOutward) {
  for (const std::int64_t seed : {1, 2, 3, 4}) ExpectClosedParts(GenerateWreck({}, seed), kParts);
}

TEST(WreckTest, OtherProportionsStayClosed) {
  WreckOptions options;
  options.length_m = 25;
  options.breadth_m = 6;
  options.depth_m = 3;
  options.list_deg = -70;
  options.hatches = 3;
  options.breaches = 5;
  options.max_edge_m = 1;
  ExpectClosedParts(GenerateWreck(options, 1), kParts);
}

TEST(WreckTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GenerateWreck({}, 1), WreckOptions{}.max_edge_m);
}

TEST(WreckTest, IsHollow) {
  const WreckOptions options = Upright();
  const RayCaster caster(GenerateWreck(options, 1));
  const double half_m = 0.5 * options.breadth_m - 0.5 * options.plate_thickness_m;
  EXPECT_FALSE(caster.Inside({-1, 0, 0})) << "hold";
  EXPECT_FALSE(caster.Inside({-1, 0, 1.25})) << "above the deck";
  EXPECT_TRUE(caster.Inside({-1, half_m, 0.8})) << "port shell";
  EXPECT_TRUE(caster.Inside({-1, -half_m, 0.8})) << "starboard shell";
  EXPECT_FALSE(caster.Inside({-1, half_m + 0.1, 0.8}));
  EXPECT_TRUE(caster.Inside({-1, 0, -1.3})) << "the floor reaches into the hold";
}

TEST(WreckTest, TheVehiclePassesThroughTheBreak) {
  const TriangleMesh mesh = GenerateWreck({}, 1);
  for (double x = -7; x < 1; x += 0.1) ASSERT_FALSE(TouchesVehicle(mesh, {x, 0, -0.1})) << x;
}

TEST(WreckTest, TheVehiclePassesThroughAHatch) {
  WreckOptions options = Upright();
  const auto is_open_above = [&](double x) {
    const TriangleMesh mesh = GenerateWreck(options, 1);
    for (double z = 3; z > -0.2; z -= 0.1) {
      if (TouchesVehicle(mesh, {x, 0, z})) return false;
    }
    return true;
  };
  EXPECT_FALSE(is_open_above(1.9));
  options.hatches = 2;
  EXPECT_TRUE(is_open_above(1.9));
}

TEST(WreckTest, TheVehiclePassesThroughABreach) {
  WreckOptions options;
  options.list_deg = 0;
  const TriangleMesh mesh = GenerateWreck(options, 1);
  const auto is_open_abeam = [&](double x, double z) {
    for (double y = -4; y < -0.5; y += 0.1) {
      if (TouchesVehicle(mesh, {x, y, z})) return false;
    }
    return true;
  };
  bool is_open = false;
  for (double x = -3; x < 2 && !is_open; x += 0.1)
    for (double z = -0.4; z < 0.6 && !is_open; z += 0.1) is_open = is_open_abeam(x, z);
  EXPECT_TRUE(is_open);
}

TEST(WreckTest, SonarSeesInsideThroughTheSidesOpenings) {
  WreckOptions options = Upright();
  EXPECT_EQ(ShareThatEnters(GenerateWreck(options, 1), -1), 0);
  options.holes = 4;
  const double holes = ShareThatEnters(GenerateWreck(options, 1), -1);
  EXPECT_GT(holes, 0.02);
  options.breaches = 2;
  EXPECT_GT(ShareThatEnters(GenerateWreck(options, 1), -1), holes + 0.1) << "starboard";
  EXPECT_GT(ShareThatEnters(GenerateWreck(options, 1), 1), holes + 0.1) << "port";
}

TEST(WreckTest, LiesOnTheFloor) {
  const WreckOptions options;
  const TriangleMesh mesh = GenerateWreck(options, 1);
  const RayCaster caster(mesh);
  // Far from the ship the rays meet the floor, some of whose metres are under the keel.
  const auto floor = caster.Cast({0, 5, 3}, -Vec3::UnitZ(), 10);
  ASSERT_TRUE(floor);
  const double level_m = 3 - floor->range_m;
  EXPECT_LT(level_m, -0.5 * options.depth_m + options.sunk_m + options.floor_relief_m);
  EXPECT_GT(level_m, -0.5 * options.depth_m - 0.5 * options.breadth_m * 0.3);
}

TEST(WreckTest, RefusesPartsThatDoNotFit) {
  const auto refuses = [](void (*change)(WreckOptions&)) {
    WreckOptions options;
    change(options);
    EXPECT_THROW(GenerateWreck(options, 1), UsageError);
  };
  refuses([](WreckOptions& o) { o.plate_thickness_m = 0.5; });
  refuses([](WreckOptions& o) { o.bulwark_m = 1.5; });
  refuses([](WreckOptions& o) { o.ragged_m = 3; });
  refuses([](WreckOptions& o) { o.hatch_m = 3.5; });
  refuses([](WreckOptions& o) { o.hatches = 5; });
  refuses([](WreckOptions& o) { o.breach_m = 2.5; });
  refuses([](WreckOptions& o) { o.deckhouse_size_m.x() = 4; });
}

}  // namespace
}  // namespace vog
