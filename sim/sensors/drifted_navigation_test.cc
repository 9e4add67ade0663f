#include "sim/sensors/drifted_navigation.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

constexpr Duration kScanPeriod{200000};
const double kStep_s = ToSeconds(kScanPeriod);

DriftOptions Noiseless() {
  DriftOptions options;
  options.variance_x_m2_s = options.variance_y_m2_s = options.variance_yaw_rad2_s = 0;
  options.sigma_z_m = options.sigma_roll_pitch_rad = 0;
  return options;
}

/// A circle with some heave, roll and pitch.
VehicleState TruthAt(Time time) {
  const double t = ToSeconds(time), yaw = 0.1 * t;
  VehicleState state;
  state.X_WB = MakePose({2 * std::sin(yaw), 3 - 2 * std::cos(yaw), 0.1 * std::sin(t)},
                        {0.02 * std::sin(t), 0.03 * std::cos(t), yaw});
  state.velocity_B_m_s = {0.2, 0, 0};
  state.angular_velocity_B_rad_s = {0, 0, 0.1};
  return state;
}

TEST(DriftedNavigationTest, WithoutNoiseIsTheTruth) {
  DriftedNavigation dut(Noiseless(), kScanPeriod, 1);
  for (int i = 0; i < 200; ++i) {
    const Time time{Duration(70000 * i)};
    const VehicleState truth = TruthAt(time);
    const VehicleNavRecord record = dut.Sample(time, i, truth);
    EXPECT_TRUE(record.X_OB.isApprox(truth.X_WB, 1e-3)) << i;
    EXPECT_EQ(record.time, time);
    EXPECT_EQ(record.sequence, i);
    EXPECT_EQ(record.velocity_B_m_s, truth.velocity_B_m_s);
    EXPECT_EQ(record.yaw_rate_rad_s, 0.1);
  }
}

TEST(DriftedNavigationTest, WithoutNoiseIsExactAtScans) {
  DriftedNavigation dut(Noiseless(), kScanPeriod, 1);
  for (int i = 0; i < 200; ++i) {
    const Time time{100000 * Duration(i)};
    EXPECT_TRUE(dut.Sample(time, i, TruthAt(time)).X_OB.isApprox(TruthAt(time).X_WB, 1e-9)) << i;
  }
}

TEST(DriftedNavigationTest, StartsAtTheTruthInXYAndYaw) {
  DriftedNavigation dut({}, kScanPeriod, 1);
  const Time start{Duration(123456)};
  const VehicleState truth = TruthAt(start);
  const Pose3 X_OB = dut.Sample(start, 0, truth).X_OB;
  EXPECT_NEAR(X_OB.translation().x(), truth.X_WB.translation().x(), 1e-12);
  EXPECT_NEAR(X_OB.translation().y(), truth.X_WB.translation().y(), 1e-12);
  EXPECT_NEAR(YawOf(X_OB), YawOf(truth.X_WB), 1e-12);
  EXPECT_NE(X_OB.translation().z(), truth.X_WB.translation().z());
}

TEST(DriftedNavigationTest, AnErrorAtTheStartStays) {
  DriftedNavigation dut(Noiseless(), kScanPeriod, 1, {0.3, -0.2, 0.1});
  const Pose3 X_OW = MakePose({0.3, -0.2, 0}, {0, 0, 0.1});
  VehicleState truth;
  for (int step = 0; step < 20; ++step) {
    truth.X_WB = MakePose({0.1 * step, 0, -1}, {0, 0, 0.02 * step});
    const Pose3 X_OB = dut.Sample(Time(step * kScanPeriod), step, truth).X_OB;
    EXPECT_TRUE(X_OB.isApprox(X_OW * truth.X_WB, 1e-9)) << step;
  }
}

class DriftScalingTest : public testing::TestWithParam<DriftScaling> {};

// A vehicle at rest heading along +y: n steps add up to n times the variance of one.
TEST_P(DriftScalingTest, GrowsAsTheClosedFormSays) {
  DriftOptions options;
  options.scaling = GetParam();
  options.variance_x_m2_s = 0.04;
  options.variance_y_m2_s = 0.01;
  options.variance_yaw_rad2_s = 0;
  VehicleState truth;
  truth.X_WB = MakePose({5, 6, -1}, {0, 0, EIGEN_PI / 2});
  constexpr int kSeeds = 3000, kSteps = 25;
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (int seed = 0; seed < kSeeds; ++seed) {
    DriftedNavigation dut(options, kScanPeriod, seed);
    VehicleNavRecord record;
    for (int i = 0; i <= kSteps; ++i) record = dut.Sample(Time(i * kScanPeriod), i, truth);
    const Vec3 error = record.X_OB.translation() - truth.X_WB.translation();
    sum += error;
    squares += error.cwiseAbs2();
  }
  const double scale =
      kSteps * (GetParam() == DriftScaling::kLiteral ? kStep_s * kStep_s : kStep_s);
  const Vec3 variance = squares / kSeeds;
  EXPECT_NEAR(variance.y() / (scale * 0.04), 1, 0.1) << "forward";
  EXPECT_NEAR(variance.x() / (scale * 0.01), 1, 0.1) << "to the side";
  EXPECT_NEAR(variance.z() / (options.sigma_z_m * options.sigma_z_m), 1, 0.1) << "does not grow";
  EXPECT_LT(std::abs(sum.y() / kSeeds), 4 * std::sqrt(scale * 0.04 / kSeeds));
  EXPECT_LT(std::abs(sum.x() / kSeeds), 4 * std::sqrt(scale * 0.01 / kSeeds));
}

TEST_P(DriftScalingTest, YawGrowsAsTheClosedFormSays) {
  DriftOptions options;
  options.scaling = GetParam();
  options.variance_yaw_rad2_s = 1e-4;
  constexpr int kSeeds = 3000, kSteps = 25;
  double squares = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    DriftedNavigation dut(options, kScanPeriod, seed);
    VehicleNavRecord record;
    for (int i = 0; i <= kSteps; ++i) record = dut.Sample(Time(i * kScanPeriod), i, {});
    squares += YawOf(record.X_OB) * YawOf(record.X_OB);
  }
  const double scale =
      kSteps * (GetParam() == DriftScaling::kLiteral ? kStep_s * kStep_s : kStep_s);
  EXPECT_NEAR(squares / kSeeds / (scale * 1e-4), 1, 0.1);
}

INSTANTIATE_TEST_SUITE_P(BothScalings, DriftScalingTest,
                         testing::Values(DriftScaling::kLiteral, DriftScaling::kRandomWalk));

TEST(DriftedNavigationTest, AskingMoreOftenDoesNotChangeTheDrift) {
  DriftedNavigation seldom({}, kScanPeriod, 3), often({}, kScanPeriod, 3);
  int sequence = 0;
  for (int scan = 0; scan <= 100; ++scan) {
    const Time time(scan * kScanPeriod);
    const Pose3 X_OB = seldom.Sample(time, scan, TruthAt(time)).X_OB;
    for (int i = scan == 0 ? 9 : 0; i < 9; ++i) {
      const Time between = time - kScanPeriod + (i + 1) * kScanPeriod / 10;
      often.Sample(between, sequence++, TruthAt(between));
    }
    EXPECT_TRUE(often.Sample(time, sequence++, TruthAt(time)).X_OB.isApprox(X_OB, 1e-12)) << scan;
  }
}

// An error to the left in yaw turns every later motion to the left.
TEST(DriftedNavigationTest, YawErrorsTurnTheMotionsThatFollow) {
  DriftOptions options = Noiseless();
  options.variance_yaw_rad2_s = 0.5;
  DriftedNavigation dut(options, kScanPeriod, 1);
  VehicleState truth;
  Pose3 X_OB = dut.Sample(Time{}, 0, truth).X_OB;
  for (int i = 1; i < 50; ++i) {
    const double yaw = YawOf(X_OB);
    const Vec3 expected = X_OB.translation() + 0.05 * Vec3(std::cos(yaw), std::sin(yaw), 0);
    truth.X_WB.translation().x() = 0.05 * i;
    X_OB = dut.Sample(Time(i * kScanPeriod), i, truth).X_OB;
    ASSERT_TRUE(X_OB.translation().isApprox(expected, 1e-9)) << i;
    ASSERT_GT(std::abs(WrapAngle(YawOf(X_OB) - yaw)), 1e-4);
  }
}

TEST(DriftedNavigationTest, VelocityIsThatOfTheDriftingPose) {
  DriftOptions options = Noiseless();
  options.variance_x_m2_s = options.variance_y_m2_s = 0.1;
  options.variance_yaw_rad2_s = 1e-4;
  DriftedNavigation dut(options, kScanPeriod, 1);
  VehicleNavRecord before = dut.Sample(Time{}, 0, TruthAt(Time{}));
  for (int i = 1; i < 400; ++i) {
    const Time time{i * Duration(10000)};
    const VehicleNavRecord record = dut.Sample(time, i, TruthAt(time));
    const Vec3 moved_B = Ominus(before.X_OB, record.X_OB).translation() / 0.01;
    EXPECT_NEAR(record.velocity_B_m_s.x(), moved_B.x(), 0.02) << i;
    EXPECT_NEAR(record.velocity_B_m_s.y(), moved_B.y(), 0.02) << i;
    const double turned = WrapAngle(YawOf(record.X_OB) - YawOf(before.X_OB)) / 0.01;
    EXPECT_NEAR(record.yaw_rate_rad_s, turned, 1e-6) << i;
    before = record;
  }
}

TEST(DriftedNavigationTest, AttitudeNoiseGoesOverLinearlyBetweenScans) {
  DriftOptions options = Noiseless();
  options.sigma_z_m = 0.1;
  options.sigma_roll_pitch_rad = 0.05;
  DriftedNavigation dut(options, kScanPeriod, 1);
  const auto sample = [&](int tenth) {
    return dut.Sample(Time(tenth * kScanPeriod / 10), tenth, {}).X_OB;
  };
  const Pose3 first = sample(10), middle = sample(15), last = sample(20);
  EXPECT_NEAR(middle.translation().z(), 0.5 * (first.translation().z() + last.translation().z()),
              1e-12);
  EXPECT_NEAR(AnglesOf(middle).roll, 0.5 * (AnglesOf(first).roll + AnglesOf(last).roll), 1e-9);
  EXPECT_NEAR(AnglesOf(middle).pitch, 0.5 * (AnglesOf(first).pitch + AnglesOf(last).pitch), 1e-9);
}

TEST(DriftedNavigationTest, IsAFunctionOfTheSeed) {
  DriftedNavigation a({}, kScanPeriod, 5), b({}, kScanPeriod, 5), c({}, kScanPeriod, 6);
  for (int i = 0; i < 10; ++i) {
    const Time time(i * kScanPeriod);
    const Pose3 X_OB = a.Sample(time, i, TruthAt(time)).X_OB;
    EXPECT_EQ(b.Sample(time, i, TruthAt(time)).X_OB.matrix(), X_OB.matrix());
    EXPECT_NE(c.Sample(time, i, TruthAt(time)).X_OB.matrix(), X_OB.matrix());
  }
}

}  // namespace
}  // namespace vog
