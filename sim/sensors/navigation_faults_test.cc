#include "sim/sensors/navigation_faults.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/scan/sonar.h"

namespace vog {
namespace {

constexpr Duration kStep{50000};
constexpr double kSpeed_m_s = 0.2, kYawRate_rad_s = 0.1;

/// A circle with some heave, roll and pitch.
VehicleState TruthAt(double t) {
  const double yaw = kYawRate_rad_s * t;
  VehicleState state;
  state.X_WB = MakePose({2 * std::sin(yaw), 3 - 2 * std::cos(yaw), 0.1 * std::sin(t)},
                        {0.02 * std::sin(t), 0.03 * std::cos(t), yaw});
  state.velocity_B_m_s = {kSpeed_m_s, 0, 0};
  state.angular_velocity_B_rad_s = {0, 0, kYawRate_rad_s};
  return state;
}

VehicleState ToldAfter(const NavigationFaultOptions& options, double seconds) {
  NavigationFaults dut(options);
  VehicleState told;
  for (int i = 0; i * ToSeconds(kStep) < seconds + 1e-9; ++i)
    told = dut.Apply(Time(i * kStep), TruthAt(i * ToSeconds(kStep)));
  return told;
}

TEST(NavigationFaultsTest, WithoutAnyIsTheTruthToTheBit) {
  NavigationFaults dut({});
  for (int i = 0; i < 50; ++i) {
    const VehicleState truth = TruthAt(0.05 * i);
    const VehicleState told = dut.Apply(Time(i * kStep), truth);
    EXPECT_EQ(told.X_WB.matrix(), truth.X_WB.matrix());
    EXPECT_EQ(told.velocity_B_m_s, truth.velocity_B_m_s);
  }
}

// A circle told too large is a larger circle through the same start.
TEST(NavigationFaultsTest, ScaledSpeedMakesALargerCircle) {
  NavigationFaultOptions options;
  options.speed_scale = 0.1;
  const double half_turn_s = EIGEN_PI / kYawRate_rad_s;
  const VehicleState told = ToldAfter(options, half_turn_s);
  EXPECT_NEAR(told.X_WB.translation().y(), 1 + 1.1 * 4, 0.01);
  EXPECT_NEAR(told.velocity_B_m_s.x(), 1.1 * kSpeed_m_s, 1e-12);
  EXPECT_NEAR(std::abs(YawOf(told.X_WB)), EIGEN_PI, 0.02);
}

TEST(NavigationFaultsTest, AMisalignedLogTurnsThePathAboutItsStart) {
  NavigationFaultOptions options;
  options.misalignment_deg = 10;
  const double quarter_s = EIGEN_PI / 2 / kYawRate_rad_s, turn = ToRadians(10);
  const VehicleState told = ToldAfter(options, quarter_s);
  EXPECT_NEAR(told.X_WB.translation().x(), 2 * std::cos(turn) - 2 * std::sin(turn), 0.01);
  EXPECT_NEAR(told.X_WB.translation().y(), 1 + 2 * std::sin(turn) + 2 * std::cos(turn), 0.01);
  EXPECT_GT(told.velocity_B_m_s.y(), 0);
}

TEST(NavigationFaultsTest, DelayedRecordsTellThePast) {
  NavigationFaultOptions options;
  options.delay_s = 0.12;
  const VehicleState told = ToldAfter(options, 5), past = TruthAt(5 - 0.12);
  EXPECT_LT((told.X_WB.translation() - past.X_WB.translation()).norm(), 1e-3);
  EXPECT_NEAR(YawOf(told.X_WB), YawOf(past.X_WB), 1e-4);
  EXPECT_NEAR(AnglesOf(told.X_WB).roll, AnglesOf(past.X_WB).roll, 1e-4);
}

TEST(NavigationFaultsTest, LosesTheBottomForAWhile) {
  NavigationFaultOptions options;
  const auto lost_at = [&](double t) {
    return NavigationFaults(options).HasLostLock(Time(FromSeconds(t)));
  };
  EXPECT_FALSE(lost_at(600));
  options.lock_lost_s = 60;
  options.lock_lost_at_s = 100;
  EXPECT_FALSE(lost_at(99.9));
  EXPECT_TRUE(lost_at(100));
  EXPECT_TRUE(lost_at(159.9));
  EXPECT_FALSE(lost_at(160));
}

TEST(NavigationFaultsTest, JumpsOnceWhenItIsTime) {
  NavigationFaultOptions options;
  options.jump_m = 3;
  options.jump_at_s = 2;
  const Vec3 before = ToldAfter(options, 1.95).X_WB.translation();
  const Vec3 after = ToldAfter(options, 2).X_WB.translation();
  const Vec3 later = ToldAfter(options, 4).X_WB.translation();
  EXPECT_LT((before - TruthAt(1.95).X_WB.translation()).norm(), 1e-3);
  EXPECT_LT((after - TruthAt(2).X_WB.translation() - Vec3(3, 0, 0)).norm(), 1e-3);
  EXPECT_LT((later - TruthAt(4).X_WB.translation() - Vec3(3, 0, 0)).norm(), 1e-3);
}

}  // namespace
}  // namespace vog
