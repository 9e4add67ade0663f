#include "sim/vehicle/current.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

constexpr double kStep_s = 0.02;

TEST(CurrentTest, IsNoneByDefault) {
  Current dut({}, kStep_s, 1);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(dut.velocity_W_m_s(), Vec3::Zero());
    dut.Step();
  }
}

TEST(CurrentTest, HasItsMeanAndSpreadFromTheStart) {
  CurrentOptions options;
  options.mean_m_s = {0.1, -0.05, 0};
  options.sigma_m_s = 0.05;
  options.time_constant_s = 1;
  constexpr int kSeeds = 4000;
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (int seed = 0; seed < kSeeds; ++seed) {
    Current dut(options, kStep_s, seed);
    for (int i = 0; i < seed % 50; ++i) dut.Step();
    const Vec3 deviation = dut.velocity_W_m_s() - options.mean_m_s;
    sum += deviation;
    squares += deviation.cwiseAbs2();
  }
  EXPECT_LT((sum / kSeeds).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_NEAR(std::sqrt(squares.x() / kSeeds), 0.05, 0.002);
  EXPECT_NEAR(std::sqrt(squares.y() / kSeeds), 0.05, 0.002);
  EXPECT_EQ(squares.z(), 0);
}

TEST(CurrentTest, RemembersItselfForTheTimeConstant) {
  CurrentOptions options;
  options.sigma_m_s = 1;
  options.time_constant_s = 2;
  constexpr int kSeeds = 4000;
  double product = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Current dut(options, kStep_s, seed);
    const double before = dut.velocity_W_m_s().x();
    for (int i = 0; i < 100; ++i) dut.Step();
    product += before * dut.velocity_W_m_s().x() / kSeeds;
  }
  EXPECT_NEAR(product, std::exp(-1), 0.05);
}

TEST(CurrentTest, IsAFunctionOfTheSeed) {
  CurrentOptions options;
  options.sigma_m_s = 0.1;
  Current a(options, kStep_s, 7), b(options, kStep_s, 7), c(options, kStep_s, 8);
  for (int i = 0; i < 20; ++i) {
    a.Step();
    b.Step();
    c.Step();
  }
  EXPECT_EQ(a.velocity_W_m_s(), b.velocity_W_m_s());
  EXPECT_NE(a.velocity_W_m_s(), c.velocity_W_m_s());
}

}  // namespace
}  // namespace vog
