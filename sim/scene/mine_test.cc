#include "sim/scene/mine.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

constexpr std::size_t kSphereAndSinker = 2, kHorns = 11 * 2, kLinks = 10;

TEST(MineTest, PartsAreClosedShellsThatPointOutward) {
  ExpectClosedParts(GenerateMine({}), kSphereAndSinker + kHorns + kLinks);
  MineOptions options;
  options.horns = 1;
  options.chain_length_m = 0.35;
  options.floor = true;
  ExpectClosedParts(GenerateMine(options), kSphereAndSinker + 2 + 2 + 1);
}

TEST(MineTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GenerateMine({}), MineOptions{}.max_edge_m);
}

TEST(MineTest, SphereIsAroundTheOrigin) {
  MineOptions options;
  options.horns = 0;
  options.chain_length_m = 3;
  const RayCaster caster(GenerateMine(options));
  for (double angle = 0; angle < 6; angle += 0.1) {
    const Vec3 outward(std::cos(angle), std::sin(angle), 0.3);
    const auto hit = caster.Cast(3 * outward.normalized(), -outward.normalized(), 5);
    ASSERT_TRUE(hit);
    ASSERT_NEAR(hit->range_m, 3 - 0.5 * options.diameter_m, 0.01);
  }
}

TEST(MineTest, HornsReachOutOfIt) {
  const MineOptions options;
  const RayCaster caster(GenerateMine(options));
  const auto top = caster.Cast({0, 0, 3}, -Vec3::UnitZ(), 5);
  ASSERT_TRUE(top);
  EXPECT_NEAR(3 - top->range_m, 0.5 * options.diameter_m + options.horn_length_m, 0.01);
  std::size_t horns = 0;
  for (const TriangleMesh& part : PartsOf(GenerateMine(options))) {
    double farthest_m = 0;
    for (const auto& t : part.triangles)
      for (const std::uint32_t v : t) farthest_m = std::max(farthest_m, part.vertices[v].norm());
    horns += std::abs(farthest_m - 0.5 * options.diameter_m - options.horn_length_m) < 0.005;
  }
  EXPECT_EQ(horns, 11u) << "one round end each";
}

// Along the chain's line there is a link, or two that hang in each other, everywhere.
TEST(MineTest, ChainLeadsFromSphereToSinker) {
  MineOptions options;
  options.horns = 0;
  const double lean = options.chain_lean_deg / 180 * std::numbers::pi;
  const double bearing = options.chain_bearing_deg / 180 * std::numbers::pi;
  const Vec3 down(std::sin(lean) * std::cos(bearing), std::sin(lean) * std::sin(bearing),
                  -std::cos(lean));
  const Vec3 across = down.cross(Vec3::UnitX()).normalized(), other = down.cross(across);
  const RayCaster caster(GenerateMine(options));
  const double start_m = 0.5 * options.diameter_m;
  for (double along_m = start_m; along_m < start_m + options.chain_length_m; along_m += 0.02) {
    bool has_link = false;
    for (double y = -0.12; y <= 0.12; y += 0.01)
      for (double z = -0.12; z <= 0.12 && !has_link; z += 0.01)
        has_link = caster.Inside(along_m * down + y * across + z * other);
    EXPECT_TRUE(has_link) << along_m;
  }
  const Vec3 end_W = (start_m + options.chain_length_m) * down;
  EXPECT_TRUE(caster.Inside(end_W - Vec3(0, 0, 0.5 * options.sinker_height_m)));
  EXPECT_FALSE(caster.Inside(end_W + Vec3(0.3, 0, 0.2)));
}

TEST(MineTest, FloorIsAtTheSinkersFoot) {
  MineOptions options;
  const double foot_m = GenerateMine(options).Bounds().min().z();
  options.floor = true;
  const RayCaster caster(GenerateMine(options));
  const auto floor = caster.Cast({5, 5, 0}, -Vec3::UnitZ(), 10);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(-floor->range_m, foot_m, 0.1 * options.sinker_height_m + 1e-6);
}

TEST(MineTest, RefusesPartsThatDoNotFit) {
  MineOptions options;
  options.horn_diameter_m = 0.6;
  EXPECT_THROW(GenerateMine(options), UsageError);
  options = {};
  options.horn_length_m = 0.05;
  EXPECT_THROW(GenerateMine(options), UsageError);
  options = {};
  options.link_bar_m = 0.1;
  EXPECT_THROW(GenerateMine(options), UsageError);
}

}  // namespace
}  // namespace vog
