#include "sim/scene/propeller.h"

#include <gtest/gtest.h>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

constexpr std::size_t kPartsBesideBlades = 5;  // Hub, shaft, bossing, rudder, stern.

TEST(PropellerTest, PartsAreClosedShellsThatPointOutward) {
  ExpectClosedParts(GeneratePropeller({}), 5 + kPartsBesideBlades);
}

TEST(PropellerTest, HasTheSizeOfTheOriginal) {
  const Eigen::AlignedBox3d bounds = GeneratePropeller({}).Bounds();
  EXPECT_TRUE(bounds.min().isApprox(Vec3(-3.5, -2, -3), 0.03)) << bounds.min().transpose();
  EXPECT_TRUE(bounds.max().isApprox(Vec3(3.5, 2, 3), 0.03)) << bounds.max().transpose();
}

TEST(PropellerTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GeneratePropeller({}), PropellerOptions{}.max_edge_m);
}

// From aft, a blade of a right-handed screw is met further forward on its leading edge, the side to
// which it turns clockwise.
TEST(PropellerTest, BladesFollowARightHandedHelix) {
  PropellerOptions options;
  options.skew_deg = 0;
  options.rudder_height_m = 0.06;
  const RayCaster caster(GeneratePropeller(options));
  constexpr double kRadius_m = 1.2;
  const auto blade_x = [&](double angle) {
    const Vec3 from(-3, -kRadius_m * std::sin(angle), kRadius_m * std::cos(angle));
    const auto hit = caster.Cast(from, Vec3::UnitX(), 10);
    return hit ? -3 + hit->range_m : -100;
  };
  const double slope = (blade_x(0.2) - blade_x(-0.2)) / 0.4;
  EXPECT_NEAR(slope, options.pitch_m / (2 * EIGEN_PI), 0.05);
}

TEST(PropellerTest, BladesAreThickAndHollowNowhere) {
  const RayCaster caster(GeneratePropeller({}));
  const PropellerOptions options;
  EXPECT_TRUE(caster.Inside({options.disc_x_m, 0, 0}));         // Hub.
  EXPECT_TRUE(caster.Inside({1.5, 0, 0}));                      // Shaft inside skeg and bossing.
  EXPECT_TRUE(caster.Inside({2, 0, -2}));                       // Skeg.
  EXPECT_TRUE(caster.Inside({-2, 0, 2.9}));                     // Counter.
  EXPECT_TRUE(caster.Inside({-2, 0, 0}));                       // Rudder.
  EXPECT_FALSE(caster.Inside({0, -3, 0}));                      // Where the vehicle starts.
  EXPECT_FALSE(caster.Inside({options.disc_x_m, 0, -2.2}));     // Aperture.
  EXPECT_FALSE(caster.Inside({options.disc_x_m - 1.4, 0, 0}));  // Between cap and rudder.
}

TEST(PropellerTest, OtherProportionsStayClosed) {
  PropellerOptions options;
  options.blades = 3;
  options.radius_m = 1;
  options.pitch_m = 1.2;
  options.blade_chord_m = 0.4;
  options.max_edge_m = 0.5;
  ExpectClosedParts(GeneratePropeller(options), 3 + kPartsBesideBlades);
}

TEST(PropellerTest, RefusesPartsThatDoNotFit) {
  PropellerOptions options;
  options.hub_radius_m = 1.9;
  EXPECT_THROW(GeneratePropeller(options), UsageError);
  options = {};
  options.shaft_radius_m = 0.5;
  EXPECT_THROW(GeneratePropeller(options), UsageError);
  options = {};
  options.counter_height_m = 3.5;
  EXPECT_THROW(GeneratePropeller(options), UsageError);
  options = {};
  options.stern_length_m = 2;
  EXPECT_THROW(GeneratePropeller(options), UsageError);
}

}  // namespace
}  // namespace vog
