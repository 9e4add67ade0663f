#include "lib/evaluation/consistency.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/base/random.h"

namespace vog {
namespace {

TEST(ConsistencyTest, CountsInStandardDeviations) {
  const Mat3 covariance = Vec3(4, 9, 0.01).asDiagonal();
  // 1 + 1 + 1, and 9 + 0 + 0, which is beyond 7.815.
  const auto judged =
      JudgeConsistency({{Vec3(2, -3, 0.1), covariance}, {Vec3(6, 0, 0), covariance}});
  ASSERT_TRUE(judged);
  EXPECT_NEAR(judged->nees_per_dimension, 12.0 / 6, 1e-12);
  EXPECT_EQ(judged->share_below_95, 0.5);
}

TEST(ConsistencyTest, TheLimitIsThatOfThreeDegreesOfFreedom) {
  const auto share = [](double chi_square) {
    return JudgeConsistency({{Vec3(std::sqrt(chi_square), 0, 0), Mat3::Identity()}})
        ->share_below_95;
  };
  EXPECT_EQ(share(7.814), 1);
  EXPECT_EQ(share(7.815), 0);
}

TEST(ConsistencyTest, TellsOfEachError) {
  const Mat3 covariance = Vec3(4, 9, 0.01).asDiagonal();
  const auto nees = NeesPerDimension({{Vec3(2, -3, 0.1), covariance}, {Vec3(6, 0, 0), covariance}});
  ASSERT_TRUE(nees);
  ASSERT_EQ(nees->size(), 2u);
  EXPECT_NEAR((*nees)[0], 1, 1e-12);
  EXPECT_NEAR((*nees)[1], 3, 1e-12);
  EXPECT_TRUE(NeesPerDimension({})->empty());
}

TEST(ConsistencyTest, TheBandHoldsNineteenOfTwenty) {
  // Chi-square of three degrees of freedom: 0.2158 and 9.3484.
  EXPECT_NEAR(NeesBand95().low, 0.21580 / 3, 1e-5);
  EXPECT_NEAR(NeesBand95().high, 9.34840 / 3, 1e-5);
}

TEST(ConsistencyTest, ErrorsDrawnFromTheirCovarianceAreConsistent) {
  Random random(1, "errors");
  Mat3 root;
  root << 0.2, 0, 0, 0.1, 0.05, 0, -0.02, 0.01, 0.03;
  std::vector<PlanarError> errors, doubled;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 error = root * random.GaussianVector(Vec3::Ones());
    errors.push_back({error, root * root.transpose()});
    doubled.push_back({2 * error, root * root.transpose()});
  }
  EXPECT_NEAR(JudgeConsistency(errors)->nees_per_dimension, 1, 0.03);
  EXPECT_NEAR(JudgeConsistency(errors)->share_below_95, 0.95, 0.006);
  EXPECT_NEAR(JudgeConsistency(doubled)->nees_per_dimension, 4, 0.12);
}

TEST(ConsistencyTest, NothingCanBeSaidWithoutErrorsOrCovariances) {
  EXPECT_FALSE(JudgeConsistency({}));
  EXPECT_FALSE(JudgeConsistency({{Vec3::Zero(), Mat3::Zero()}}));
}

}  // namespace
}  // namespace vog
