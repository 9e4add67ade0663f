#include "sim/scene/tank.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

TEST(TankTest, PartsAreClosedShellsThatPointOutward) {
  ExpectClosedParts(GenerateTank({}), 2u + 2 + TankOptions{}.ladder_rungs);
}

TEST(TankTest, HasTheSizeOfTheOriginal) {
  const Eigen::AlignedBox3d bounds = GenerateTank({}).Bounds();
  EXPECT_TRUE(bounds.min().isApprox(Vec3(-3.5, -3.5, -1.5), 1e-3)) << bounds.min().transpose();
  EXPECT_TRUE(bounds.max().isApprox(Vec3(3.5, 3.5, 1.5), 1e-3)) << bounds.max().transpose();
}

TEST(TankTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GenerateTank({}), TankOptions{}.max_edge_m);
}

TEST(TankTest, WallAndFloorStandWhereTheySay) {
  const TankOptions options;
  const RayCaster caster(GenerateTank(options));
  const double inner_m = 0.5 * options.diameter_m - options.wall_thickness_m;
  const double sagitta_m = inner_m * (1 - std::cos(std::numbers::pi / options.facets));
  for (double bearing = -2; bearing < 1.9; bearing += 0.1) {
    const auto hit = caster.Cast({0, 0, 0.8}, {std::cos(bearing), std::sin(bearing), 0}, 10);
    ASSERT_TRUE(hit);
    EXPECT_LE(hit->range_m, inner_m + 1e-5);
    EXPECT_GE(hit->range_m, inner_m - sagitta_m - 1e-5);
  }
  const auto floor = caster.Cast({-1, 1, 0}, -Vec3::UnitZ(), 10);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->range_m, 0.5 * options.height_m - options.wall_thickness_m, 1e-5);
  EXPECT_TRUE(floor->normal_W.isApprox(Vec3::UnitZ(), 1e-6));
  EXPECT_FALSE(caster.Cast({-1, 1, 0}, Vec3::UnitZ(), 100)) << "the top is open";
}

TEST(TankTest, WaterIsOutsideWallBoxAndLadder) {
  const TankOptions options;
  const RayCaster caster(GenerateTank(options));
  EXPECT_FALSE(caster.Inside({0, 0, 0}));
  EXPECT_FALSE(caster.Inside({0, 0, -1.4}));
  EXPECT_TRUE(caster.Inside({0, 0, -1.47}));       // Floor.
  EXPECT_TRUE(caster.Inside({0.01, 3.466, 0.1}));  // Wall.
  EXPECT_TRUE(caster.Inside({options.box_x_m, options.box_y_m, -0.9}));
  EXPECT_FALSE(caster.Inside({options.box_x_m, options.box_y_m, -0.4}));
}

TEST(TankTest, LadderHasItsRungs) {
  const TankOptions options;
  const RayCaster caster(GenerateTank(options));
  const double bearing = options.ladder_bearing_deg * std::numbers::pi / 180;
  const Vec3 outward(std::cos(bearing), std::sin(bearing), 0);
  const double wall_m = 0.5 * options.diameter_m - options.wall_thickness_m;
  int rungs = 0;
  bool on_rung = false;
  for (double z = -1.4; z < 1.45; z += 0.005) {
    const auto hit = caster.Cast(Vec3(0, 0, z), outward, 10);
    ASSERT_TRUE(hit);
    const bool rung = hit->range_m < wall_m - 0.5 * options.ladder_clearance_m;
    rungs += rung && !on_rung;
    on_rung = rung;
  }
  EXPECT_EQ(rungs, options.ladder_rungs);
}

TEST(TankTest, RefusesPartsThatDoNotFit) {
  TankOptions options;
  options.wall_thickness_m = 1;
  EXPECT_THROW(GenerateTank(options), UsageError);
  options = {};
  options.ladder_clearance_m = 4;
  EXPECT_THROW(GenerateTank(options), UsageError);
}

}  // namespace
}  // namespace vog
