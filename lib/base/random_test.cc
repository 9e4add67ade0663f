#include "lib/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace vog {
namespace {

std::vector<double> Draws(Random random, int count) {
  std::vector<double> draws;
  for (int i = 0; i < count; ++i) draws.push_back(random.Uniform(0, 1));
  return draws;
}

TEST(RandomTest, OneNameGivesOneStream) {
  EXPECT_EQ(Draws(Random(5, "sonar", 7), 100), Draws(Random(5, "sonar", 7), 100));
}

TEST(RandomTest, OtherSeedsStreamsAndStepsGiveOtherNumbers) {
  std::set<double> seen;
  for (int seed = 0; seed < 10; ++seed)
    for (const char* stream : {"", "a", "b", "ab", "ba"})
      for (int step = 0; step < 10; ++step)
        for (const double draw : Draws(Random(seed, stream, step), 4)) seen.insert(draw);
  EXPECT_EQ(seen.size(), 10u * 5 * 10 * 4);
}

TEST(RandomTest, FirstDrawsOfSuccessiveStepsAreIndependent) {
  constexpr int kSteps = 20000;
  double sum = 0, products = 0, before = 0;
  for (int step = 0; step < kSteps; ++step) {
    const double x = Random(1, "steps", step).Gaussian(1);
    sum += x;
    products += x * before;
    before = x;
  }
  EXPECT_NEAR(sum / kSteps, 0, 4 / std::sqrt(kSteps));
  EXPECT_NEAR(products / kSteps, 0, 4 / std::sqrt(kSteps));
}

TEST(RandomTest, NumbersHaveTheMomentsAsked) {
  constexpr int kDraws = 100'000;
  Random random(2, "moments");
  double sum = 0, squares = 0, uniform = 0;
  int chances = 0;
  std::vector<int> counts(7);
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.Gaussian(3);
    sum += x;
    squares += x * x;
    const double u = random.Uniform(-2, 6);
    ASSERT_GE(u, -2);
    ASSERT_LT(u, 6);
    uniform += u;
    chances += random.Chance(0.3);
    ++counts.at(random.Index(7));
  }
  const double tolerance = 5 / std::sqrt(kDraws);  // Five standard deviations of a mean.
  EXPECT_NEAR(sum / kDraws, 0, 3 * tolerance);
  EXPECT_NEAR(squares / kDraws, 9, 9 * std::sqrt(2) * tolerance);
  EXPECT_NEAR(uniform / kDraws, 2, 8 / std::sqrt(12) * tolerance);
  EXPECT_NEAR(static_cast<double>(chances) / kDraws, 0.3, 0.5 * tolerance);
  for (const int count : counts) EXPECT_NEAR(count * 7.0 / kDraws, 1, 3 * tolerance);
}

TEST(RandomTest, VectorsHaveASigmaPerAxis) {
  Random random(3, "vectors");
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (int i = 0; i < 20000; ++i) squares += random.GaussianVector({1, 0, 5}).cwiseAbs2();
  EXPECT_NEAR(squares.x() / 20000, 1, 0.05);
  EXPECT_EQ(squares.y(), 0);
  EXPECT_NEAR(squares.z() / 20000, 25, 1.3);
}

TEST(RandomTest, CertaintiesAreCertain) {
  Random random(4, "chance");
  for (int i = 0; i < 1000; ++i) {
    EXPECT_FALSE(random.Chance(0));
    EXPECT_TRUE(random.Chance(1));
    EXPECT_EQ(random.Index(1), 0);
  }
}

}  // namespace
}  // namespace vog
