#include "sim/vehicle/vehicle.h"

#include <gtest/gtest.h>

#include <numbers>

namespace vog {
namespace {

constexpr double kStep_s = 0.02;
constexpr double kDegree = std::numbers::pi / 180;

void Drive(Vehicle& dut, double seconds, const VelocityCommand& command,
           const Vec3& current_W_m_s = Vec3::Zero()) {
  for (double t = 0; t < seconds - 0.5 * kStep_s; t += kStep_s)
    dut.Step(kStep_s, command, current_W_m_s);
}

VehicleOptions WithoutThrusters() {
  VehicleOptions options;
  options.thruster_limit_n = 0;
  return options;
}

/// Kinetic energy of the body and of the water that moves with it, and that of righting.
double EnergyOf(const VehicleOptions& options, const VehicleState& state) {
  const Vec3 v = state.velocity_B_m_s, w = state.angular_velocity_B_rad_s;
  const Vec3 mass = Vec3::Constant(options.mass_kg) + options.added_mass_kg;
  const Vec3 inertia = options.inertia_kg_m2 + options.added_inertia_kg_m2;
  const double righting =
      options.mass_kg * 9.81 * options.metacentric_height_m * (1 - state.X_WB(2, 2));
  return 0.5 * v.dot(mass.cwiseProduct(v)) + 0.5 * w.dot(inertia.cwiseProduct(w)) + righting;
}

TEST(VehicleTest, RestStaysAtRest) {
  const Pose3 X_WB = MakePose({1, 2, -3}, {0, 0, 0.7});
  Vehicle dut({}, X_WB);
  Drive(dut, 60, {});
  EXPECT_TRUE(dut.state().X_WB.isApprox(X_WB, 1e-12));
  EXPECT_LT(dut.state().velocity_B_m_s.norm(), 1e-12);
  for (const double thrust_n : dut.thrusters_n()) EXPECT_NEAR(thrust_n, 0, 1e-9);
}

class VehicleCommandTest : public testing::TestWithParam<VelocityCommand> {};

TEST_P(VehicleCommandTest, ReachesAndHoldsTheCommand) {
  const VelocityCommand command = GetParam();
  Vehicle dut({}, Pose3::Identity());
  Drive(dut, 3, command);
  for (int second = 0; second < 60; ++second) {
    Drive(dut, 1, command);
    const Vec3 error = dut.state().velocity_B_m_s - command.velocity_B_m_s;
    ASSERT_LT(error.norm(), 0.03 * 0.25) << "after " << second << " s: " << error.transpose();
    ASSERT_NEAR(dut.state().angular_velocity_B_rad_s.z(), command.yaw_rate_rad_s, 0.03 * 0.15);
    const RollPitchYaw angles = AnglesOf(dut.state().X_WB);
    ASSERT_LT(std::abs(angles.roll), 4 * kDegree);
    ASSERT_LT(std::abs(angles.pitch), 4 * kDegree);
  }
}

TEST_P(VehicleCommandTest, HoldsItAgainstACurrent) {
  VelocityCommand command = GetParam();
  command.velocity_B_m_s *= 0.8;  // The one sway thruster cannot do 0.25 + 0.2 m/s.
  command.yaw_rate_rad_s = 0;
  for (const Vec3& current_W_m_s : {Vec3(0.2, 0, 0), Vec3(0, -0.2, 0), Vec3(-0.14, 0.14, 0)}) {
    Vehicle dut({}, Pose3::Identity());
    Drive(dut, 25, command, current_W_m_s);
    const Vec3 error = dut.state().velocity_B_m_s - command.velocity_B_m_s;
    EXPECT_LT(error.norm(), 0.03 * 0.25) << current_W_m_s.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllAxes, VehicleCommandTest,
    testing::Values(VelocityCommand{{0.25, 0, 0}, 0}, VelocityCommand{{-0.25, 0, 0}, 0},
                    VelocityCommand{{0, 0.25, 0}, 0}, VelocityCommand{{0, 0, 0.25}, 0},
                    VelocityCommand{{0, 0, -0.25}, 0}, VelocityCommand{{0, 0, 0}, 0.15},
                    VelocityCommand{{0.14, 0.14, 0.14}, -0.15}));

TEST(VehicleTest, DoesNotOvershootOrRushAhead) {
  const VehicleOptions options;
  Vehicle dut(options, Pose3::Identity());
  double peak_m_s = 0, before_m_s = 0;
  for (int i = 0; i < 500; ++i) {
    dut.Step(kStep_s, {{0.25, 0, 0}, 0}, Vec3::Zero());
    const double speed_m_s = dut.state().velocity_B_m_s.x();
    EXPECT_LT(speed_m_s - before_m_s, 1.2 * options.max_acceleration_m_s2 * kStep_s);
    peak_m_s = std::max(peak_m_s, before_m_s = speed_m_s);
  }
  EXPECT_LT(peak_m_s, 0.26);
}

TEST(VehicleTest, CutsCommandsToTheLimits) {
  VehicleOptions options;
  options.max_speed_m_s = 0.3;
  options.max_yaw_rate_rad_s = 0.2;
  Vehicle dut(options, Pose3::Identity());
  Drive(dut, 20, {{5, 0, 0}, -3});
  EXPECT_NEAR(dut.state().velocity_B_m_s.norm(), 0.3, 0.01);
  EXPECT_NEAR(dut.state().angular_velocity_B_rad_s.z(), -0.2, 0.01);
}

TEST(VehicleTest, TurnsLeftAndMovesWhereItPoints) {
  Vehicle dut({}, Pose3::Identity());
  Drive(dut, 10, {{0, 0, 0}, 0.15});
  const double yaw = YawOf(dut.state().X_WB);
  EXPECT_NEAR(yaw, 0.15 * 10, 0.1);
  Drive(dut, 5, {});
  const Pose3 X_WB = dut.state().X_WB;
  Drive(dut, 10, {{0.2, 0, 0}, 0});
  const Vec3 moved_B =
      X_WB.linear().transpose() * (dut.state().X_WB.translation() - X_WB.translation());
  EXPECT_NEAR(moved_B.x(), 0.2 * 10, 0.2);
  EXPECT_NEAR(moved_B.y(), 0, 0.02);
  EXPECT_NEAR(moved_B.z(), 0, 0.02);
}

TEST(VehicleTest, RollAndPitchRightThemselves) {
  Vehicle dut({}, MakePose({0, 0, 0}, {20 * kDegree, -15 * kDegree, 0.3}));
  Drive(dut, 60, {});
  const RollPitchYaw angles = AnglesOf(dut.state().X_WB);
  EXPECT_LT(std::abs(angles.roll), 0.2 * kDegree);
  EXPECT_LT(std::abs(angles.pitch), 0.2 * kDegree);
}

TEST(VehicleTest, EnergyDecaysWithoutThrust) {
  const VehicleOptions options = WithoutThrusters();
  Vehicle dut(options, Pose3::Identity());
  dut.set_state({.X_WB = MakePose({0, 0, 0}, {0.3, -0.2, 1}),
                 .velocity_B_m_s = {0.5, -0.3, 0.2},
                 .angular_velocity_B_rad_s = {0.2, 0.3, -0.5}});
  const double start = EnergyOf(options, dut.state());
  double energy = start;
  for (int second = 0; second < 60; ++second) {
    Drive(dut, 1, {});
    ASSERT_LE(EnergyOf(options, dut.state()), energy);
    energy = EnergyOf(options, dut.state());
  }
  EXPECT_LT(energy, 0.01 * start);
}

TEST(VehicleTest, DriftsWithTheCurrent) {
  Vehicle dut(WithoutThrusters(), MakePose({0, 0, 0}, {0, 0, 2}));
  const Vec3 current_W_m_s(0.1, -0.15, 0);
  Drive(dut, 120, {}, current_W_m_s);
  const Vec3 velocity_W = dut.state().X_WB.linear() * dut.state().velocity_B_m_s;
  EXPECT_LT((velocity_W - current_W_m_s).norm(), 0.01);
}

// Thrust and drag balance: 110 N = 20 v + 163 v^2; the vehicle's builder says 0.77 m/s.
TEST(VehicleTest, FullThrustGivesTheKnownTopSpeed) {
  VehicleOptions options;
  options.max_speed_m_s = 5;
  Vehicle dut(options, Pose3::Identity());
  Drive(dut, 60, {{5, 0, 0}, 0});
  const double top_m_s = (-20 + std::sqrt(20 * 20 + 4 * 163 * 110.0)) / (2 * 163);
  EXPECT_NEAR(dut.state().velocity_B_m_s.x(), top_m_s, 0.01);
  EXPECT_NEAR(top_m_s, 0.77, 0.03);
}

TEST(VehicleTest, ComesBackFromSaturationWithoutWindup) {
  VehicleOptions options;
  options.max_speed_m_s = 5;
  Vehicle dut(options, Pose3::Identity());
  Drive(dut, 60, {{5, 0, 0}, 0});
  Drive(dut, 35, {{0.2, 0, 0}, 0});
  EXPECT_NEAR(dut.state().velocity_B_m_s.x(), 0.2, 0.01);
}

TEST(VehicleTest, ThrustersLag) {
  VehicleOptions options;
  options.thruster_lag_s = 0.15;
  Vehicle lagging(options, Pose3::Identity());
  options.thruster_lag_s = 0;
  Vehicle instant(options, Pose3::Identity());
  Drive(lagging, 0.14, {{0.25, 0, 0}, 0});
  Drive(instant, 0.14, {{0.25, 0, 0}, 0});
  EXPECT_GT(lagging.thrusters_n()[0], 1);
  EXPECT_LT(lagging.thrusters_n()[0], 0.8 * instant.thrusters_n()[0]);
}

TEST(VehicleTest, HalfTheStepGivesTheSamePath) {
  Vehicle coarse({}, Pose3::Identity()), fine({}, Pose3::Identity());
  const VelocityCommand command{{0.2, 0.1, -0.05}, 0.1};
  const Vec3 current_W_m_s(0.05, 0.1, 0);
  for (int i = 0; i < 1500; ++i) {
    coarse.Step(0.02, command, current_W_m_s);
    fine.Step(0.01, command, current_W_m_s);
    fine.Step(0.01, command, current_W_m_s);
  }
  EXPECT_LT((coarse.state().X_WB.translation() - fine.state().X_WB.translation()).norm(), 0.01);
}

TEST(VehicleTest, EqualInputsGiveEqualBits) {
  Vehicle a({}, Pose3::Identity()), b({}, Pose3::Identity());
  for (int i = 0; i < 2000; ++i) {
    const VelocityCommand command{{0.2 * std::sin(0.01 * i), 0.1, 0.05}, 0.1 * std::cos(0.02 * i)};
    a.Step(kStep_s, command, {0.1, 0, 0});
    b.Step(kStep_s, command, {0.1, 0, 0});
  }
  EXPECT_EQ(a.state().X_WB.matrix(), b.state().X_WB.matrix());
  EXPECT_EQ(a.state().velocity_B_m_s, b.state().velocity_B_m_s);
}

TEST(VehicleOptionsTest, ReadsItsTable) {
  const Config config = Config::Parse("[vehicle]\nmass_kg = 80.0\nhull_size_m = [1, 2, 3]", "v");
  EXPECT_EQ(config.Read<VehicleOptions>("vehicle").mass_kg, 80);
  EXPECT_EQ(config.Read<VehicleOptions>("vehicle").hull_size_m, Vec3(1, 2, 3));
  EXPECT_THROW(Config::Parse("[vehicle]\nmass_kg = 0", "v").Read<VehicleOptions>("vehicle"),
               UsageError);
}

}  // namespace
}  // namespace vog
