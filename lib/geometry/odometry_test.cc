#include "lib/geometry/odometry.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "lib/base/random.h"

namespace vog {
namespace {

Mat3 RandomCovariance(double sigma, Random& random) {
  const Mat3 root = Mat3::NullaryExpr([&] { return random.Gaussian(sigma); });
  return root * root.transpose();
}

/// A draw from N(0, covariance).
Vec3 Draw(const Mat3& covariance, Random& random) {
  return covariance.llt().matrixL() * random.GaussianVector(Vec3::Ones());
}

Pose3 PlanarExp(const Vec3& xi) {
  Vec6 full = Vec6::Zero();
  full << xi.x(), xi.y(), 0, 0, 0, xi.z();
  return Exp(full);
}

Vec3 PlanarLog(const Pose3& X) {
  const Vec6 xi = Log(X);
  return {xi[0], xi[1], xi[5]};
}

Pose3 RandomMotion(Random& random) {
  return MakePose({random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-1, 1)},
                  {0, 0, random.Uniform(-3, 3)});
}

OdometrySample Sample(int ms, double x_m, std::int64_t segment = 1) {
  OdometrySample sample;
  sample.time = Time(std::chrono::milliseconds(ms));
  sample.segment = segment;
  sample.X_OB = MakePose({x_m, 0, 0});
  sample.covariance = x_m * Mat3::Identity();
  sample.velocity_B_m_s = Vec3(x_m, 0, 0);
  sample.yaw_rate_rad_s = x_m;
  return sample;
}

TEST(OdometryTest, ThePlanarAdjointIsTheAdjointOfALevelMotion) {
  Random random(1, "odometry");
  constexpr int kIndex[3] = {0, 1, 5};
  for (int i = 0; i < 50; ++i) {
    const Pose3 X = RandomMotion(random);
    const Mat6 full = AdjointOf(X);
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col)
        EXPECT_NEAR(PlanarAdjointOf(X)(row, col), full(kIndex[row], kIndex[col]), 1e-12);
  }
}

TEST(OdometryTest, ComposedCovariancesAreThoseOfManyDraws) {
  Random random(2, "odometry");
  constexpr int kDraws = 20000;
  for (int i = 0; i < 5; ++i) {
    const Pose3 X_AB = RandomMotion(random), X_BC = RandomMotion(random);
    const Mat3 P_AB = RandomCovariance(0.01, random), P_BC = RandomCovariance(0.01, random);
    Mat3 drawn = Mat3::Zero();
    for (int k = 0; k < kDraws; ++k) {
      const Pose3 X_AC =
          X_AB * PlanarExp(Draw(P_AB, random)) * X_BC * PlanarExp(Draw(P_BC, random));
      const Vec3 error = PlanarLog(Ominus(X_AB * X_BC, X_AC));
      drawn += error * error.transpose() / kDraws;
    }
    const Mat3 composed = ComposePlanarCovariance(P_AB, X_BC, P_BC);
    EXPECT_LT((drawn - composed).norm(), 0.06 * composed.norm());
  }
}

TEST(OdometryTest, TheCovarianceOfAMotionIsWhatWasAddedAfterItsStart) {
  Random random(3, "odometry");
  for (int i = 0; i < 50; ++i) {
    OdometrySample from = Sample(0, 0), to = Sample(100, 0);
    from.X_OB = RandomMotion(random);
    from.covariance = RandomCovariance(0.3, random);
    const Pose3 X_FT = RandomMotion(random);
    to.X_OB = from.X_OB * X_FT;
    const Mat3 added = RandomCovariance(0.1, random);
    to.covariance = ComposePlanarCovariance(from.covariance, X_FT, added);
    EXPECT_TRUE(MotionCovariance(from, to).isApprox(added, 1e-6));
    EXPECT_TRUE(MotionCovariance(from, from).isZero(1e-9));
  }
}

TEST(OdometryTest, CovariancesOfMotionsAreNeverNegative) {
  Random random(4, "odometry");
  OdometrySample from = Sample(0, 0), to = Sample(100, 0);
  from.covariance = RandomCovariance(1, random);
  to.covariance = 0.999 * from.covariance;  // As rounding may have it.
  const Mat3 P = MotionCovariance(from, to);
  for (int i = 0; i < 20; ++i) {
    const Vec3 v = random.GaussianVector(Vec3::Ones());
    EXPECT_GE(v.dot(P * v), -1e-15);
  }
}

TEST(OdometryTest, AStepsCovarianceFollowsTheScaling) {
  DriftOptions drift;
  drift.variance_x_m2_s = 1;
  drift.variance_y_m2_s = 2;
  drift.variance_yaw_rad2_s = 3;
  drift.scaling = DriftScaling::kLiteral;
  EXPECT_TRUE(drift.StepCovariance(0.2).isApprox(0.04 * Mat3(Vec3(1, 2, 3).asDiagonal()), 1e-12));
  drift.scaling = DriftScaling::kRandomWalk;
  EXPECT_TRUE(drift.StepCovariance(0.2).isApprox(0.2 * Mat3(Vec3(1, 2, 3).asDiagonal()), 1e-12));
  // A random walk does not mind how a second is cut; the formula as printed does.
  EXPECT_TRUE((10 * drift.StepCovariance(0.1)).isApprox(5 * drift.StepCovariance(0.2), 1e-12));
  EXPECT_EQ(DriftOptions{}.scaling, DriftScaling::kLiteral);
}

TEST(OdometryHistoryTest, IsLinearBetweenItsSamples) {
  OdometryHistory dut;
  for (int i = 0; i <= 10; ++i) dut.Add(Sample(100 * i, i));
  for (int ms = 0; ms <= 1000; ms += 7) {
    const auto sample = dut.At(Time(std::chrono::milliseconds(ms)));
    ASSERT_TRUE(sample);
    const double x = ms / 100.0;
    EXPECT_EQ(sample->time, Time(std::chrono::milliseconds(ms)));
    EXPECT_EQ(sample->segment, 1);
    EXPECT_NEAR(sample->X_OB.translation().x(), x, 1e-12);
    EXPECT_TRUE(sample->covariance.isApprox(x * Mat3::Identity(), 1e-12));
    EXPECT_NEAR(sample->velocity_B_m_s.x(), x, 1e-12);
    EXPECT_NEAR(sample->yaw_rate_rad_s, x, 1e-12);
  }
}

TEST(OdometryHistoryTest, KnowsNothingOutsideItsSamples) {
  OdometryHistory dut;
  EXPECT_FALSE(dut.At(Time{}));
  dut.Add(Sample(100, 1));
  EXPECT_TRUE(dut.At(Time(std::chrono::milliseconds(100))));
  dut.Add(Sample(200, 2));
  EXPECT_FALSE(dut.At(Time(std::chrono::milliseconds(99))));
  EXPECT_FALSE(dut.At(Time(std::chrono::milliseconds(201))));
}

TEST(OdometryHistoryTest, KnowsNothingInALongGap) {
  OdometryHistory dut;
  dut.Add(Sample(100, 1));
  dut.Add(Sample(1100, 2));
  EXPECT_TRUE(dut.At(Time(std::chrono::milliseconds(600))));
  dut.Add(Sample(2101, 3));
  EXPECT_FALSE(dut.At(Time(std::chrono::milliseconds(1600))));
  EXPECT_TRUE(dut.At(Time(std::chrono::milliseconds(2101))));
}

TEST(OdometryHistoryTest, ANewSegmentForgetsTheOldOne) {
  OdometryHistory dut;
  dut.Add(Sample(100, 1, 1));
  dut.Add(Sample(200, 2, 1));
  dut.Add(Sample(300, 3, 2));
  EXPECT_FALSE(dut.At(Time(std::chrono::milliseconds(150))));
  EXPECT_FALSE(dut.At(Time(std::chrono::milliseconds(250))));
  EXPECT_EQ(dut.oldest().segment, 2);
}

TEST(OdometryHistoryTest, ForgetsOnlyWhatNoLaterMomentNeeds) {
  OdometryHistory dut;
  for (int i = 0; i <= 10; ++i) dut.Add(Sample(100 * i, i));
  dut.ForgetBefore(Time(std::chrono::milliseconds(450)));
  EXPECT_EQ(dut.oldest().time, Time(std::chrono::milliseconds(400)));
  EXPECT_TRUE(dut.At(Time(std::chrono::milliseconds(450))));
  dut.ForgetBefore(Time(std::chrono::milliseconds(5000)));
  EXPECT_FALSE(dut.empty());
  EXPECT_EQ(dut.newest().time, Time(std::chrono::milliseconds(1000)));
}

}  // namespace
}  // namespace vog
