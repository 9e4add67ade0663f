#include "sim/scene/pier.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/overlap.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

const Vec3 kHull_m(1, 1, 0.5);

/// Piles alone.
PierOptions BarePiles() {
  PierOptions options;
  options.bent_braces = false;
  options.bays_per_brace = 0;
  options.top = PierTop::kNone;
  options.floor = false;
  return options;
}

Vec3 RegularPlace(const PierOptions& options, int row, int bent, double z) {
  return {(bent - 0.5 * (options.bents - 1)) * options.bent_spacing_m,
          (row - 0.5 * (options.rows - 1)) * options.row_spacing_m, z};
}

TEST(PierTest, PartsAreClosedShellsThatPointOutward) {
  const std::size_t piles = 2 * 5, bent_braces = 2 * 5, bay_braces = 2 * 2 * 2, beams = 5, deck = 1,
                    floor = 1;
  for (const std::int64_t seed : {1, 2, 3})
    ExpectClosedParts(GeneratePier({}, seed),
                      piles + bent_braces + bay_braces + beams + deck + floor);
}

TEST(PierTest, EveryPartIsOptional) {
  PierOptions options = BarePiles();
  ExpectClosedParts(GeneratePier(options, 1), 10);
  options.top = PierTop::kBeams;
  ExpectClosedParts(GeneratePier(options, 1), 10 + 5);
  options.bays_per_brace = 1;
  ExpectClosedParts(GeneratePier(options, 1), 10 + 5 + 2 * 4 * 2);
  options.rows = 1;
  options.bent_braces = true;
  ExpectClosedParts(GeneratePier(options, 1), 5 + 5 + 4 * 2);
  options.rows = 3;
  options.bents = 1;
  ExpectClosedParts(GeneratePier(options, 1), 3 + 1 + 2 * 2);
}

TEST(PierTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GeneratePier({}, 1), PierOptions{}.max_edge_m);
}

TEST(PierTest, RegularPilesStandInTheirPlaces) {
  PierOptions options = BarePiles();
  options.offset_m = options.lean_deg = options.diameter_spread = 0;
  const RayCaster caster(GeneratePier(options, 1));
  for (int row = 0; row < options.rows; ++row)
    for (int bent = 0; bent < options.bents; ++bent)
      for (const double z : {-2.2, 0.0, 2.2}) {
        const Vec3 place_W = RegularPlace(options, row, bent, z);
        ASSERT_TRUE(caster.Inside(place_W));
        const auto hit = caster.Cast(place_W + Vec3(0, 1, 0), -Vec3::UnitY(), 1);
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->range_m, 1 - 0.5 * options.pile_diameter_m, 0.01);
      }
}

/// Where rays from all around meet a pile at height z: the middle of its section and its diameter.
struct Section {
  Vec3 middle_W;
  double diameter_m;
};
Section SectionAt(const RayCaster& caster, const Vec3& place_W) {
  constexpr int kRays = 180;
  Eigen::AlignedBox3d bounds;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRays;
    const Vec3 outward(std::cos(angle), std::sin(angle), 0);
    const auto hit = caster.Cast(place_W + 1.2 * outward, -outward, 2);
    if (hit) bounds.extend(place_W + (1.2 - hit->range_m) * outward);
  }
  return {bounds.center(), bounds.sizes().x()};
}

TEST(PierTest, PilesDifferAsMuchAsTheOptionsAllow) {
  const PierOptions options = BarePiles();
  const RayCaster caster(GeneratePier(options, 1));
  double most_offset_m = 0, most_lean_m = 0;
  Eigen::AlignedBox1d diameters;
  for (int row = 0; row < options.rows; ++row)
    for (int bent = 0; bent < options.bents; ++bent) {
      const Vec3 middle_W = RegularPlace(options, row, bent, 0);
      const Section middle = SectionAt(caster, middle_W);
      const Section high = SectionAt(caster, middle_W + Vec3(0, 0, 2));
      most_offset_m = std::max(most_offset_m, (middle.middle_W - middle_W).norm());
      most_lean_m = std::max(most_lean_m, (high.middle_W - middle.middle_W).head<2>().norm());
      diameters.extend(Eigen::Matrix<double, 1, 1>(middle.diameter_m));
    }
  EXPECT_LE(most_offset_m, options.offset_m + 0.02);
  EXPECT_GT(most_offset_m, 0.3 * options.offset_m);
  const double lean_m = 2 * std::tan(options.lean_deg / 180 * std::numbers::pi);
  EXPECT_LE(most_lean_m, lean_m + 0.02);
  EXPECT_GT(most_lean_m, 0.3 * lean_m);
  EXPECT_GE(diameters.min().x(), options.pile_diameter_m * (1 - options.diameter_spread) - 0.02);
  EXPECT_LE(diameters.max().x(), options.pile_diameter_m * (1 + options.diameter_spread) + 0.02);
  EXPECT_GT(diameters.sizes().x(), 0.05 * options.pile_diameter_m);
}

// Of two bays one has braces along the rows.
TEST(PierTest, TheVehiclePassesThroughOpenBays) {
  const PierOptions options;
  const TriangleMesh mesh = GeneratePier(options, 1);
  const auto touches = [&](double x, double y) {
    return BoxTouches(mesh, MakePose({x, y, 0}), kHull_m);
  };
  for (double y = -4; y <= 4; y += 0.1)
    ASSERT_FALSE(touches(-1.5 * options.bent_spacing_m, y)) << y;
  EXPECT_TRUE(touches(-0.5 * options.bent_spacing_m, -0.5 * options.row_spacing_m));
  EXPECT_FALSE(touches(-0.5 * options.bent_spacing_m, 0));
  EXPECT_TRUE(touches(0, 0)) << "a braced bent";
}

TEST(PierTest, DeckAndFloorAreAboveAndBelow) {
  const PierOptions options;
  const RayCaster caster(GeneratePier(options, 1));
  const auto up = caster.Cast({-4.2, 0, 0}, Vec3::UnitZ(), 10);
  ASSERT_TRUE(up);
  EXPECT_NEAR(up->range_m, 0.5 * (options.height_m + options.beam_size_m), 0.03);
  EXPECT_LT(up->normal_W.z(), -0.99);
  const auto down = caster.Cast({-4.2, 0, 0}, -Vec3::UnitZ(), 10);
  ASSERT_TRUE(down);
  EXPECT_NEAR(down->range_m, 0.5 * options.height_m, options.floor_relief_m);
}

TEST(PierTest, RefusesPartsThatDoNotFit) {
  PierOptions options;
  options.row_spacing_m = 0.7;
  EXPECT_THROW(GeneratePier(options, 1), UsageError);
  options = {};
  options.bent_spacing_m = 0.7;
  EXPECT_THROW(GeneratePier(options, 1), UsageError);
  options = {};
  options.brace_diameter_m = 0.4;
  EXPECT_THROW(GeneratePier(options, 1), UsageError);
}

}  // namespace
}  // namespace vog
