#include "lib/submap/sensor_model.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

TEST(SensorModelTest, UnitsAreExactLogOdds) {
  for (int units = -126; units <= 126; ++units) {
    EXPECT_EQ(ToUnits(ToLogOdds(units)), units);
    EXPECT_EQ(32 * ToLogOdds(units), units);
    EXPECT_EQ(ToUnits(LogOddsOfProbability(ProbabilityOfLogOdds(ToLogOdds(units)))), units);
  }
}

// Readers mark with the ends of the range what is not a value.
TEST(SensorModelTest, NoLogOddsBecomeTheUnknown) {
  for (const double log_odds : {-4.0, -1e6, -1e300, 4.0, 1e300})
    EXPECT_NE(ToUnits(log_odds), kUnknownUnits);
  EXPECT_EQ(ToUnits(-1e300), -126);
  EXPECT_EQ(ToUnits(1e300), 126);
}

TEST(SensorModelTest, DefaultsAreOctoMapsToAThirtySecond) {
  const SensorModel dut{SensorModelOptions{}};
  EXPECT_NEAR(ProbabilityOfLogOdds(ToLogOdds(dut.hit)), 0.7, 0.004);
  EXPECT_NEAR(ProbabilityOfLogOdds(ToLogOdds(dut.miss)), 0.4, 0.004);
  EXPECT_NEAR(ToLogOdds(dut.min), -2, 1.0 / 64);
  EXPECT_NEAR(ToLogOdds(dut.max), 3.5, 1.0 / 64 + 0.02);
  EXPECT_EQ(dut.occupied_from, 0);
}

TEST(SensorModelTest, ClampsToItsBoundsAndNoFurther) {
  const SensorModel dut{SensorModelOptions{}};
  for (int units = -1000; units <= 1000; ++units) {
    const int clamped = dut.Clamp(units);
    EXPECT_GE(clamped, dut.min);
    EXPECT_LE(clamped, dut.max);
    if (units >= dut.min && units <= dut.max) {
      EXPECT_EQ(clamped, units);
    }
  }
}

TEST(SensorModelTest, AllOptionsAllowedFitIntoUnits) {
  SensorModelOptions options;
  options.hit_probability = options.max_probability = 0.98;
  options.miss_probability = options.min_probability = 0.02;
  const SensorModel dut(options);
  EXPECT_NEAR(ToLogOdds(dut.hit), LogOddsOfProbability(0.98), 1.0 / 64);
  EXPECT_NEAR(ToLogOdds(dut.miss), LogOddsOfProbability(0.02), 1.0 / 64);
}

}  // namespace
}  // namespace vog
