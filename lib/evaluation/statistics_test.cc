#include "lib/evaluation/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lib/base/random.h"

namespace vog {
namespace {

TEST(StatisticsTest, SpreadOfFiveNumbers) {
  const auto spread = SpreadOf({1, 2, 3, 4, 5});
  ASSERT_TRUE(spread && spread->interval_95);
  EXPECT_EQ(spread->count, 5);
  EXPECT_EQ(spread->mean, 3);
  EXPECT_NEAR(*spread->standard_deviation, 1.5811388300841898, 1e-15);
  // t = 2.7764451051977987 for 4 degrees of freedom.
  EXPECT_NEAR(spread->interval_95->low, 3 - 1.9632431614775607, 1e-12);
  EXPECT_NEAR(spread->interval_95->high, 3 + 1.9632431614775607, 1e-12);
}

TEST(StatisticsTest, OneValueHasNoSpreadAndNoValueNothing) {
  const auto one = SpreadOf({2.5});
  ASSERT_TRUE(one);
  EXPECT_EQ(one->mean, 2.5);
  EXPECT_FALSE(one->standard_deviation || one->interval_95);
  EXPECT_FALSE(SpreadOf({}));
}

TEST(StatisticsTest, TheIntervalHoldsTheMeanIn95OfAHundred) {
  Random random(1, "interval");
  int holds = 0;
  constexpr int kSamples = 4000;
  for (int n = 0; n < kSamples; ++n) {
    std::vector<double> sample;
    for (int i = 0; i < 6; ++i) sample.push_back(7 + random.Gaussian(2));
    const Interval interval = *SpreadOf(sample)->interval_95;
    holds += interval.low < 7 && 7 < interval.high;
  }
  EXPECT_NEAR(static_cast<double>(holds) / kSamples, 0.95, 0.012);
}

TEST(StatisticsTest, RatiosOfProportionalSamplesAreSure) {
  const auto ratio = RatioOfMeans({1, 2, 3, 10}, {2, 4, 6, 20}, 1);
  ASSERT_TRUE(ratio && ratio->interval_95);
  EXPECT_EQ(ratio->value, 0.5);
  EXPECT_EQ(ratio->interval_95->low, 0.5);
  EXPECT_EQ(ratio->interval_95->high, 0.5);
}

TEST(StatisticsTest, TheRatiosIntervalIsThatOfTheDeltaMethod) {
  Random random(1, "ratio");
  std::vector<double> numerators, denominators;
  for (int i = 0; i < 400; ++i) {
    denominators.push_back(4 + random.Gaussian(0.8));
    numerators.push_back(1 + random.Gaussian(0.3));
  }
  const auto ratio = RatioOfMeans(numerators, denominators, 1);
  std::vector<double> residuals;  // Of numerator - ratio * denominator, over the mean denominator.
  for (std::size_t i = 0; i < numerators.size(); ++i)
    residuals.push_back((numerators[i] - ratio->value * denominators[i]) /
                        SpreadOf(denominators)->mean);
  const double half = 1.96 * *SpreadOf(residuals)->standard_deviation / std::sqrt(400);
  EXPECT_NEAR(ratio->interval_95->low, ratio->value - half, 0.1 * half);
  EXPECT_NEAR(ratio->interval_95->high, ratio->value + half, 0.1 * half);
}

TEST(StatisticsTest, ASeedDrawsTheSameAgain) {
  const auto low = [&](std::uint64_t seed) {
    return RatioOfMeans({1, 5, 2, 8, 3, 3.5}, {4, 3, 9, 2, 5, 6}, seed)->interval_95->low;
  };
  EXPECT_EQ(low(1), low(1));
  EXPECT_NE(low(1), low(2));
}

TEST(StatisticsTest, RatiosThatMakeNoSense) {
  EXPECT_FALSE(RatioOfMeans({}, {}, 1));
  EXPECT_FALSE(RatioOfMeans({1, 2}, {0, 1}, 1));
  EXPECT_FALSE(RatioOfMeans({3}, {2}, 1)->interval_95);
}

/// By counting all signs of the same sizes.
double BruteForceP(const std::vector<double>& differences) {
  std::vector<double> sizes;
  for (const double difference : differences)
    if (difference != 0) sizes.push_back(std::abs(difference));
  const auto rank = [&](double size) {
    const auto below =
        std::count_if(sizes.begin(), sizes.end(), [&](double s) { return s < size; });
    const auto equal = std::count(sizes.begin(), sizes.end(), size);
    return static_cast<double>(below) + 0.5 * static_cast<double>(equal + 1);
  };
  double middle = 0, seen = 0;
  for (const double size : sizes) middle += 0.5 * rank(size);
  for (const double difference : differences) seen += difference > 0 ? rank(difference) : 0;
  int as_far = 0;
  for (unsigned signs = 0; signs < 1u << sizes.size(); ++signs) {
    double sum = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) sum += signs >> i & 1 ? rank(sizes[i]) : 0;
    as_far += std::abs(sum - middle) >= std::abs(seen - middle) - 1e-9;
  }
  return as_far / std::ldexp(1.0, static_cast<int>(sizes.size()));
}

TEST(StatisticsTest, WilcoxonCountsAllSigns) {
  Random random(1, "wilcoxon");
  for (int n = 0; n < 60; ++n) {
    std::vector<double> differences;
    // Whole numbers, so that there are ties and zeros.
    for (int i = 0; i < n % 12; ++i) differences.push_back(random.Index(14) - 5);
    EXPECT_NEAR(WilcoxonSignedRankP(differences), BruteForceP(differences), 1e-12);
  }
}

// Darwin's maize: heights of crossed less those of self-fertilised plants, in eighths of an inch.
TEST(StatisticsTest, WilcoxonOfDarwinsMaize) {
  EXPECT_EQ(WilcoxonSignedRankP({49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48}),
            0.041259765625);
}

TEST(StatisticsTest, WilcoxonWithoutDifferencesIsOneAndOfManyIsSmall) {
  EXPECT_EQ(WilcoxonSignedRankP({}), 1);
  EXPECT_EQ(WilcoxonSignedRankP({0, 0}), 1);
  EXPECT_EQ(WilcoxonSignedRankP({1}), 1);
  std::vector<double> differences;
  for (int i = 1; i <= 30; ++i) differences.push_back(-i);
  EXPECT_NEAR(WilcoxonSignedRankP(differences), std::ldexp(1.0, -29), 1e-15);
}

}  // namespace
}  // namespace vog
