#include "hardware/sonar/lens.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lib/base/errors.h"
#include "lib/scan/sonar.h"

namespace vog {
namespace {

TEST(LensTest, BearingsGiveTheirBeamsBackAndAscend) {
  for (const int beams : {96, 48}) {
    const auto bearings_rad = DidsonBearings(beams, BeamSpacing::kLens);
    ASSERT_EQ(bearings_rad.size(), static_cast<std::size_t>(beams));
    for (int beam = 0; beam < beams; ++beam) {
      EXPECT_NEAR(LensBeamAt(beams, bearings_rad[beam]), beam, 1e-9);
    }
    EXPECT_TRUE(std::is_sorted(bearings_rad.begin(), bearings_rad.end()));
  }
}

TEST(LensTest, IsNearTheUniformFan) {
  for (const int beams : {96, 48}) {
    const auto lens_rad = DidsonBearings(beams, BeamSpacing::kLens);
    const auto uniform_rad = DidsonBearings(beams, BeamSpacing::kUniform);
    for (int beam = 0; beam < beams; ++beam)
      EXPECT_NEAR(ToDegrees(lens_rad[beam]), ToDegrees(uniform_rad[beam]), 2) << beam;
    EXPECT_NEAR(ToDegrees(uniform_rad.back() - uniform_rad.front()), 28.8 * (beams - 1) / beams,
                1e-9);
  }
}

TEST(LensTest, RefusesOtherSonars) {
  EXPECT_THROW(DidsonBearings(64, BeamSpacing::kLens), UsageError);
  EXPECT_THROW(DidsonBearings(0, BeamSpacing::kUniform), UsageError);
  EXPECT_THROW(LensBeamAt(-1, 0), UsageError);
}

}  // namespace
}  // namespace vog
