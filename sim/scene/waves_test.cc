#include "sim/scene/waves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

TEST(WavesTest, StayWithinTheirAmplitudeAndUseIt) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Waves waves(0.5, 4, Waves::Directions::kAll, Random(seed, "waves test"));
    Random random(seed, "waves test places");
    double lowest = 0, highest = 0;
    for (int i = 0; i < 20000; ++i) {
      const double height = waves.At(random.GaussianVector(Vec3::Constant(30)));
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    EXPECT_GE(lowest, -0.5);
    EXPECT_LE(highest, 0.5);
    EXPECT_LT(lowest, -0.3);
    EXPECT_GT(highest, 0.3);
  }
}

TEST(WavesTest, AreSmooth) {
  const Waves waves(0.5, 4, Waves::Directions::kAll, Random(1, "waves test"));
  // All waves of half the length would be the steepest.
  const double steepest = 0.5 * 2 * EIGEN_PI / 2;
  for (double x = -20; x < 20; x += 0.01)
    ASSERT_LE(std::abs(waves.At({x + 0.01, 1, 2}) - waves.At({x, 1, 2})), 0.01 * steepest);
}

TEST(WavesTest, LevelOnesDoNotChangeWithHeight) {
  const Waves level(1, 4, Waves::Directions::kLevel, Random(1, "waves test"));
  const Waves all(1, 4, Waves::Directions::kAll, Random(1, "waves test"));
  EXPECT_EQ(level.At({1, 2, 0}), level.At({1, 2, 5}));
  EXPECT_NE(all.At({1, 2, 0}), all.At({1, 2, 5}));
}

TEST(WavesTest, AreTheSeeds) {
  const auto at = [](std::uint64_t seed) {
    return Waves(1, 4, Waves::Directions::kLevel, Random(seed, "waves test")).At({1, 2, 0});
  };
  EXPECT_EQ(at(7), at(7));
  EXPECT_NE(at(7), at(8));
}

}  // namespace
}  // namespace vog
