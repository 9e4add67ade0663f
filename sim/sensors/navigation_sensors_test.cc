#include "sim/sensors/navigation_sensors.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace vog {
namespace {

constexpr Duration kImuPeriod{50000};
constexpr int kSamples = 40000;

VehicleState Truth() {
  return {.X_WB = MakePose({1, 2, -3}, {0.1, -0.2, 0.5}),
          .velocity_B_m_s = {0.2, -0.1, 0.05},
          .angular_velocity_B_rad_s = {0.01, 0.02, 0.1}};
}

SensorOptions Noiseless() {
  SensorOptions options;
  options.dvl_sigma_m_s.setZero();
  options.dvl_dropout_share = options.dvl_bias_sigma_m_s = options.dvl_scale_sigma = 0;
  options.gyro_noise_density_rad_s_sqrt_hz = options.gyro_bias_sigma_rad_s = 0;
  options.gyro_bias_walk_rad_s_sqrt_h = options.attitude_sigma_deg = options.depth_sigma_m = 0;
  return options;
}

TEST(NavigationSensorsTest, WithoutNoiseMeasuresTheTruth) {
  NavigationSensors dut(Noiseless(), kImuPeriod, 1);
  const Time time{Duration(100)};
  const DvlRecord dvl = dut.Dvl(time, 3, Truth());
  EXPECT_TRUE(dvl.valid);
  EXPECT_EQ(dvl.velocity_B_m_s, Truth().velocity_B_m_s);
  EXPECT_EQ(dvl.time, time);
  EXPECT_EQ(dvl.sequence, 3);
  const ImuRecord imu = dut.Imu(time, 4, Truth());
  EXPECT_NEAR(imu.roll_rad, 0.1, 1e-12);
  EXPECT_NEAR(imu.pitch_rad, -0.2, 1e-12);
  EXPECT_EQ(imu.angular_velocity_B_rad_s, Truth().angular_velocity_B_rad_s);
  EXPECT_EQ(imu.sequence, 4);
  const DepthRecord depth = dut.Depth(time, 5, Truth());
  EXPECT_EQ(depth.depth_m, 3) << "down positive";
  EXPECT_EQ(depth.sequence, 5);
}

TEST(NavigationSensorsTest, TheDopplerLogsBiasAndScaleLastAndDifferFromSeedToSeed) {
  SensorOptions options = Noiseless();
  options.dvl_bias_sigma_m_s = 0.01;
  options.dvl_scale_sigma = 0.05;
  constexpr int kSeeds = 2000;
  double bias = 0, scale = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    NavigationSensors dut(options, kImuPeriod, seed);
    VehicleState truth = Truth();
    truth.velocity_B_m_s = {1, 0, 0};
    const Vec3 first = dut.Dvl({}, 0, truth).velocity_B_m_s;
    EXPECT_EQ(dut.Dvl({}, 1, truth).velocity_B_m_s, first);
    truth.velocity_B_m_s.setZero();
    const Vec3 still = dut.Dvl({}, 2, truth).velocity_B_m_s;
    bias += still.squaredNorm() / 3 / kSeeds;
    scale += std::pow(first.x() - still.x() - 1, 2) / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(bias), 0.01, 0.0005);
  EXPECT_NEAR(std::sqrt(scale), 0.05, 0.0025);
}

TEST(NavigationSensorsTest, NoiseIsAsStrongAsTheOptionsSay) {
  SensorOptions options;
  options.dvl_dropout_share = options.dvl_bias_sigma_m_s = options.dvl_scale_sigma = 0;
  options.gyro_bias_sigma_rad_s = options.gyro_bias_walk_rad_s_sqrt_h = 0;
  NavigationSensors dut(options, kImuPeriod, 1);
  double dvl = 0, roll = 0, gyro = 0, depth = 0;
  for (int i = 0; i < kSamples; ++i) {
    const VehicleState truth = Truth();
    const ImuRecord imu = dut.Imu({}, i, truth);
    dvl += std::pow(dut.Dvl({}, i, truth).velocity_B_m_s.x() - 0.2, 2) / kSamples;
    roll += std::pow(imu.roll_rad - 0.1, 2) / kSamples;
    gyro += std::pow(imu.angular_velocity_B_rad_s.z() - 0.1, 2) / kSamples;
    depth += std::pow(dut.Depth({}, i, truth).depth_m - 3, 2) / kSamples;
  }
  EXPECT_NEAR(std::sqrt(dvl), 0.0266, 0.0005);
  EXPECT_NEAR(std::sqrt(roll), 0.2 * EIGEN_PI / 180, 1e-4);
  EXPECT_NEAR(std::sqrt(gyro), 3.4e-4 * std::sqrt(20.0), 5e-5);
  EXPECT_NEAR(std::sqrt(depth), 0.021, 0.0005);
}

TEST(NavigationSensorsTest, DropoutsAreAsManyAndAsLongAsTheOptionsSay) {
  NavigationSensors dut({}, kImuPeriod, 1);
  int lost = 0, in_a_row = 0, longest = 0;
  for (int i = 0; i < kSamples; ++i) {
    const DvlRecord record = dut.Dvl({}, i, Truth());
    if (!record.valid) {
      EXPECT_EQ(record.velocity_B_m_s, Vec3::Zero());
      ++lost;
    }
    in_a_row = record.valid ? 0 : in_a_row + 1;
    longest = std::max(longest, in_a_row);
  }
  EXPECT_NEAR(static_cast<double>(lost) / kSamples, 0.087, 0.005);
  EXPECT_EQ(longest, 2);
}

TEST(NavigationSensorsTest, LongDropoutsKeepTheShare) {
  SensorOptions options;
  options.dvl_dropout_share = 0.3;
  options.dvl_dropout_goes_on = 0.9;
  options.dvl_dropout_max = 20;
  NavigationSensors dut(options, kImuPeriod, 1);
  int lost = 0;
  for (int i = 0; i < kSamples; ++i) lost += !dut.Dvl({}, i, Truth()).valid;
  EXPECT_NEAR(static_cast<double>(lost) / kSamples, 0.3, 0.02);
}

TEST(NavigationSensorsTest, GyroBiasWandersFromItsStart) {
  SensorOptions options = Noiseless();
  options.gyro_bias_sigma_rad_s = 1e-3;
  options.gyro_bias_walk_rad_s_sqrt_h = 6e-3;
  constexpr int kSeeds = 2000, kSteps = 200;  // 10 s, 1/360 h.
  double start = 0, walked = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    NavigationSensors dut(options, kImuPeriod, seed);
    const Vec3 first = dut.Imu({}, 0, {}).angular_velocity_B_rad_s;
    Vec3 last = first;
    for (int i = 1; i <= kSteps; ++i) last = dut.Imu({}, i, {}).angular_velocity_B_rad_s;
    start += first.squaredNorm() / 3 / kSeeds;
    walked += (last - first).squaredNorm() / 3 / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(start), 1e-3, 5e-5);
  EXPECT_NEAR(std::sqrt(walked), 6e-3 / std::sqrt(360), 2e-5);
}

// What one instrument draws must not shift another's noise.
TEST(NavigationSensorsTest, StreamsAreIndependent) {
  NavigationSensors alone({}, kImuPeriod, 9), together({}, kImuPeriod, 9);
  for (int i = 0; i < 50; ++i) {
    together.Dvl({}, i, Truth());
    together.Depth({}, i, Truth());
    EXPECT_EQ(alone.Imu({}, i, Truth()).angular_velocity_B_rad_s,
              together.Imu({}, i, Truth()).angular_velocity_B_rad_s);
  }
}

}  // namespace
}  // namespace vog
