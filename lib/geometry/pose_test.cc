#include "lib/geometry/pose.h"

#include <gtest/gtest.h>

#include <numbers>

#include "lib/base/random.h"

namespace vog {
namespace {

using std::numbers::pi;

Vec6 RandomTwist(double length_m, double angle_rad, Random& random) {
  Vec6 xi;
  xi << length_m * random.GaussianVector(Vec3::Ones()),
      angle_rad * random.GaussianVector(Vec3::Ones()).normalized();
  return xi;
}

Pose3 RandomPose(Random& random) {
  return MakePose(random.GaussianVector({5, 5, 5}),
                  {random.Uniform(-pi, pi), random.Uniform(-1.5, 1.5), random.Uniform(-pi, pi)});
}

/// The exponential as its power series, which knows nothing of angles.
Eigen::Matrix4d SeriesExp(const Vec6& xi) {
  Eigen::Matrix4d hat = Eigen::Matrix4d::Zero();
  hat.topLeftCorner<3, 3>() = SkewOf(xi.tail<3>());
  hat.topRightCorner<3, 1>() = xi.head<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int n = 1; n < 40; ++n) {
    term = term * hat / n;
    sum += term;
  }
  return sum;
}

TEST(PoseTest, AnglesSurvive) {
  Random random(1, "pose");
  for (int i = 0; i < 200; ++i) {
    const RollPitchYaw angles{random.Uniform(-pi, pi), random.Uniform(-1.57, 1.57),
                              random.Uniform(-pi, pi)};
    const Pose3 X = MakePose({1, 2, 3}, angles);
    const RollPitchYaw read = AnglesOf(X);
    EXPECT_NEAR(read.roll, angles.roll, 1e-9);
    EXPECT_NEAR(read.pitch, angles.pitch, 1e-9);
    EXPECT_NEAR(read.yaw, angles.yaw, 1e-9);
    EXPECT_EQ(YawOf(X), read.yaw);
  }
}

TEST(PoseTest, AnglesTurnTheWayTheDocsSay) {
  const double angle = pi / 2;
  EXPECT_TRUE((MakePose({0, 0, 0}, {0, 0, angle}) * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-12));
  EXPECT_TRUE((MakePose({0, 0, 0}, {0, angle, 0}) * Vec3::UnitX()).isApprox(-Vec3::UnitZ(), 1e-12));
  EXPECT_TRUE((MakePose({0, 0, 0}, {angle, 0, 0}) * Vec3::UnitY()).isApprox(Vec3::UnitZ(), 1e-12));
  // R = Rz Ry Rx: x forward keeps its roll.
  const Pose3 X = MakePose({0, 0, 0}, {0.3, angle, angle});
  EXPECT_TRUE((X * Vec3::UnitX()).isApprox(-Vec3::UnitZ(), 1e-12));
}

TEST(PoseTest, LevelKeepsXYAndYawAlone) {
  Random random(2, "level");
  const Pose3 X_AB = RandomPose(random), level = Level(X_AB);
  EXPECT_EQ(level.translation(), Vec3(X_AB.translation().x(), X_AB.translation().y(), 0));
  EXPECT_NEAR(YawOf(level), YawOf(X_AB), 1e-12);
  EXPECT_EQ(level.linear().col(2), Vec3::UnitZ());
}

TEST(PoseTest, WrapAngleKeepsTheDirection) {
  Random random(2, "pose");
  for (int i = 0; i < 500; ++i) {
    const double angle = random.Uniform(-100, 100), wrapped = WrapAngle(angle);
    EXPECT_GT(wrapped, -pi);
    EXPECT_LE(wrapped, pi);
    EXPECT_NEAR(std::sin(wrapped), std::sin(angle), 1e-9);
    EXPECT_NEAR(std::cos(wrapped), std::cos(angle), 1e-9);
  }
  EXPECT_EQ(WrapAngle(pi), pi);
  EXPECT_EQ(WrapAngle(-pi), pi);
  EXPECT_EQ(WrapAngle(0), 0);
}

TEST(PoseTest, OminusIsTheMotionFromTheFirstToTheSecond) {
  Random random(3, "pose");
  for (int i = 0; i < 50; ++i) {
    const Pose3 X_WA = RandomPose(random), X_WB = RandomPose(random);
    EXPECT_TRUE((X_WA * Ominus(X_WA, X_WB)).isApprox(X_WB, 1e-12));
    EXPECT_TRUE(Ominus(X_WA, X_WA).isApprox(Pose3::Identity(), 1e-12));
    EXPECT_TRUE((Ominus(X_WA, X_WB) * Ominus(X_WB, X_WA)).isApprox(Pose3::Identity(), 1e-12));
  }
}

TEST(PoseTest, ExpIsItsPowerSeries) {
  Random random(4, "pose");
  for (const double angle : {0.0, 1e-12, 1e-7, 1e-5, 1e-3, 0.1, 1.0, 3.0, 3.14, 5.0})
    for (int i = 0; i < 20; ++i) {
      const Vec6 xi = RandomTwist(2, angle, random);
      EXPECT_LT((Exp(xi).matrix() - SeriesExp(xi)).norm(), 1e-9) << angle;
    }
}

TEST(PoseTest, LogUndoesExp) {
  Random random(5, "pose");
  for (const double angle : {0.0, 1e-12, 1e-7, 1e-5, 1e-3, 0.1, 1.0, 3.0, 3.1415})
    for (int i = 0; i < 20; ++i) {
      const Vec6 xi = RandomTwist(2, angle, random);
      EXPECT_LT((Log(Exp(xi)) - xi).norm(), 1e-8) << angle;
    }
}

TEST(PoseTest, ExpUndoesLogUpToHalfATurn) {
  Random random(6, "pose");
  for (int i = 0; i < 100; ++i) {
    // Half of them half a turn about some axis.
    const Vec6 xi = RandomTwist(2, i % 2 ? pi : random.Uniform(0, pi), random);
    const Pose3 X = Exp(xi);
    EXPECT_TRUE(Exp(Log(X)).isApprox(X, 1e-9));
    EXPECT_LE(Log(X).tail<3>().norm(), pi + 1e-9);
  }
}

TEST(PoseTest, TheAdjointMovesAPerturbationFromTheRightToTheLeft) {
  Random random(7, "pose");
  for (int i = 0; i < 100; ++i) {
    const Pose3 X = RandomPose(random);
    const Vec6 xi = RandomTwist(1, 0.7, random);
    EXPECT_TRUE((X * Exp(xi)).isApprox(Exp(AdjointOf(X) * xi) * X, 1e-9));
    EXPECT_TRUE((AdjointOf(X) * AdjointOf(X.inverse())).isIdentity(1e-9));
  }
}

TEST(PoseTest, TheAdjointIsTheDerivativeOfAMotionsEnds) {
  // Ominus(A Exp(a), B) = Ominus(A, B) Exp(-Ad(B^-1 A) a) to first order.
  Random random(8, "pose");
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 20; ++i) {
    const Pose3 A = RandomPose(random), B = RandomPose(random);
    const Mat6 analytic = -AdjointOf(Ominus(B, A));
    for (int k = 0; k < 6; ++k) {
      const Vec6 step = kStep * Vec6::Unit(k);
      const Vec6 forward = Log(Ominus(Ominus(A, B), Ominus(A * Exp(step), B)));
      const Vec6 backward = Log(Ominus(Ominus(A, B), Ominus(A * Exp(-step), B)));
      EXPECT_LT(((forward - backward) / (2 * kStep) - analytic.col(k)).norm(), 1e-6);
    }
  }
}

TEST(PoseTest, InterpolationGoesFromOneToTheOther) {
  Random random(9, "pose");
  for (int i = 0; i < 50; ++i) {
    const Pose3 X_WA = RandomPose(random);
    const Pose3 X_WB = X_WA * Exp(RandomTwist(1, random.Uniform(0, 3), random));
    EXPECT_TRUE(Interpolate(X_WA, X_WB, 0).isApprox(X_WA, 1e-9));
    EXPECT_TRUE(Interpolate(X_WA, X_WB, 1).isApprox(X_WB, 1e-9));
    const double fraction = random.Uniform(0, 1);
    const Pose3 X_WC = Interpolate(X_WA, X_WB, fraction);
    const double whole = Log(Ominus(X_WA, X_WB)).tail<3>().norm();
    EXPECT_NEAR(Log(Ominus(X_WA, X_WC)).tail<3>().norm(), fraction * whole, 1e-9);
    EXPECT_NEAR(Log(Ominus(X_WC, X_WB)).tail<3>().norm(), (1 - fraction) * whole, 1e-9);
    EXPECT_TRUE(X_WC.translation().isApprox(
        X_WA.translation() + fraction * (X_WB.translation() - X_WA.translation()), 1e-9));
  }
}

TEST(PoseTest, QuaternionsNeedNotBeOfLengthOne) {
  const Pose3 X = MakePose({1, 2, 3}, Eigen::Quaterniond(2, 0, 0, 2));
  EXPECT_TRUE((X.linear() * X.linear().transpose()).isIdentity(1e-12));
  EXPECT_NEAR(YawOf(X), pi / 2, 1e-12);
}

}  // namespace
}  // namespace vog
