#include "lib/navigation/instrument_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "lib/navigation/dive_testing.h"

namespace vog {
namespace {

using State = InstrumentFilter::State;

State ErrorOf(const InstrumentFilter& filter, const Dive& dive) {
  State error = dive.Truth() - filter.state();
  for (int i = 0; i < 3; ++i) error[i] = WrapAngle(error[i]);
  return error;
}

State SigmasOf(const InstrumentFilter& filter) {
  return filter.covariance().diagonal().cwiseSqrt();
}

TEST(InstrumentFilterTest, TheJacobianIsThatOfTheDerivative) {
  Random random(1, "jacobian");
  for (int i = 0; i < 200; ++i) {
    State state;
    for (double& entry : state) entry = random.Uniform(-0.6, 0.6);
    const Vec3 rates = random.GaussianVector(Vec3::Constant(0.3));
    const InstrumentFilter::Covariance F = InstrumentFilter::Jacobian(state, rates);
    for (int k = 0; k < InstrumentFilter::kSize; ++k) {
      const State step = 1e-6 * State::Unit(k);
      const State numeric = (InstrumentFilter::Derivative(state + step, rates) -
                             InstrumentFilter::Derivative(state - step, rates)) /
                            2e-6;
      EXPECT_TRUE(numeric.isApprox(F.col(k), 1e-7) || (numeric - F.col(k)).norm() < 1e-8) << k;
    }
  }
}

TEST(InstrumentFilterTest, ItsErrorsAreAsLargeAsItSays) {
  for (const double bias_factor : {1.0, 10.0}) {
    const InstrumentErrors errors = LargerBiases({}, bias_factor);
    State squares = State::Zero();
    double nees = 0;
    constexpr int kRuns = 40;
    for (int seed = 0; seed < kRuns; ++seed) {
      DeadReckoner dut(DeadReckoningOptions{errors}, 1);
      Dive dive(errors, seed);
      dive.Run(dut, 200);
      const State error = ErrorOf(dut.filter(), dive);
      squares += error.cwiseQuotient(SigmasOf(dut.filter())).cwiseAbs2() / kRuns;
      nees += error.dot(dut.filter().covariance().llt().solve(error)) / kRuns /
              static_cast<int>(InstrumentFilter::kSize);
    }
    EXPECT_GT(nees, 0.5) << squares.transpose();
    EXPECT_LT(nees, 2) << bias_factor << ": " << squares.transpose();
    // The height follows the velocity a step late, for which the scale seems surer than it is.
    EXPECT_LT(squares[InstrumentFilter::kDvlScale], 5) << bias_factor;
    squares[InstrumentFilter::kDvlScale] = 0;
    EXPECT_LT(squares.maxCoeff(), 2) << bias_factor << ": " << squares.transpose();
  }
}

TEST(InstrumentFilterTest, LearnsWhatIsObservedAndKnowsWhatIsNot) {
  const InstrumentErrors errors = LargerBiases({}, 10);
  DeadReckoner dut(DeadReckoningOptions{errors}, 1);
  const State before = SigmasOf(dut.filter());
  Dive dive(errors, 3);
  dive.Run(dut, 300);
  const State after = SigmasOf(dut.filter()), error = ErrorOf(dut.filter(), dive);
  // The gyro's biases in roll and pitch, the Doppler log's in the vertical, its scale in a dive.
  for (const int i : {InstrumentFilter::kGyroBias + 0, InstrumentFilter::kGyroBias + 1,
                      InstrumentFilter::kDvlBias + 2, InstrumentFilter::kDvlScale + 0}) {
    EXPECT_LT(after[i], 0.7 * before[i]) << i;
    EXPECT_LT(std::abs(error[i]), 4 * after[i]) << i;
  }
  // Nothing sees those about the vertical and along the horizontal.
  for (const int i : {InstrumentFilter::kGyroBias + 2, InstrumentFilter::kDvlBias + 0,
                      InstrumentFilter::kDvlBias + 1})
    EXPECT_GT(after[i], 0.9 * before[i]) << i;
  EXPECT_GT(after[InstrumentFilter::kYaw], 0.9 * 300 * before[InstrumentFilter::kGyroBias + 2]);
}

TEST(InstrumentFilterTest, AJumpOfTheHeightTeachesNoBias) {
  InstrumentFilter dut{InstrumentErrors{}};
  dut.Start({}, -3);
  dut.ForgetVelocity(0.1);
  const State before = dut.state();
  dut.MeasureHeight(-30, 6, 0.2);
  EXPECT_NEAR(dut.z_m(), -3 - 0.2 * 27, 1e-9);
  State others = dut.state() - before;
  others[InstrumentFilter::kHeight] = 0;
  EXPECT_TRUE(others.isZero(0));
}

TEST(InstrumentFilterTest, ItsCovarianceStaysOneOnAHardDay) {
  InstrumentFilter dut{InstrumentErrors{}};
  dut.Start({}, -3);
  Random random(5, "hard");
  for (int i = 0; i < 3000; ++i) {
    dut.Predict(random.Uniform(0, 5), random.GaussianVector(Vec3::Constant(1)));
    dut.MeasureAttitude(random.Uniform(-4, 4), random.Uniform(-1.6, 1.6));
    if (random.Chance(0.5)) dut.MeasureVelocity(random.GaussianVector(Vec3::Constant(3)));
    if (random.Chance(0.5)) dut.MeasureHeight(random.Uniform(-100, 100), 6, 0.2);
    if (random.Chance(0.1)) dut.ForgetVelocity(0.15);
    ASSERT_TRUE(dut.state().allFinite()) << i;
    const Eigen::SelfAdjointEigenSolver<InstrumentFilter::Covariance> eigen(dut.covariance());
    ASSERT_GT(eigen.eigenvalues()[0], -1e-9 * eigen.eigenvalues()[InstrumentFilter::kSize - 1]);
  }
}

}  // namespace
}  // namespace vog
