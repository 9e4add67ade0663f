#include "procs/nav_bridge/hauv_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "procs/map_service/node_testing.h"
#include "procs/nav_bridge/nav_bridge_node.h"

namespace vog {
namespace {

constexpr std::int64_t kStart_us = 1468966347000000;

class HauvMessagesTest : public testing::Test {
 protected:
  HauvMessagesTest() : bus_(bench_.queue, "dut", 10) {
    settings_.run_id = Bench::kRun;
    dut_ = std::make_unique<NavBridgeNode>(bus_, settings_);
  }

  template <class Message>
  void Say(const char* channel, const Message& message) {
    bench_.queue.PublishAt(bench_.queue.now(), channel, Encode(message));
    bench_.RunFor(Duration(0));
  }
  /// North at 0.2 m/s, 2 m deep, heading north.
  void SayNavigation(int tick, std::int64_t shift_us = 0) {
    hauv::bs_rnv_2_t rnv{};
    hauv::bs_cnv_t cnv{};
    rnv.time = rnv.time_nav = cnv.time_nav = kStart_us + 100'000 * tick;
    cnv.time_nav += shift_us;
    cnv.x = 0.02 * tick;
    cnv.z = rnv.depth = 2;
    rnv.absroll = 0.01;
    rnv.abspitch = 0.02;
    Say("HAUV_BS_RNV_2", rnv);
    Say("HAUV_BS_CNV", cnv);
  }

  Bench bench_;
  ProcessBus bus_;
  NavBridgeSettings settings_;
  std::unique_ptr<NavBridgeNode> dut_;
};

TEST_F(HauvMessagesTest, TheTypesAreThoseOfTheLogs) {
  const auto hash = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  EXPECT_EQ(hash(hauv::bs_rnv_2_t::getHash()), 0x9cfd3b6d1ed28796u);
  EXPECT_EQ(hash(hauv::bs_cnv_t::getHash()), 0xb10fa926e13b88e8u);
  EXPECT_EQ(hash(hauv::bs_dvl_2_t::getHash()), 0xf6387f1ceb3f59f6u);
  EXPECT_EQ(hash(hauv::bs_imu_t::getHash()), 0xee4922c84cfa2736u);
  EXPECT_EQ(hash(hauv::bs_rdp_t::getHash()), 0x0da09106e46968d2u);
}

TEST_F(HauvMessagesTest, ALogsNavigationBecomesOurs) {
  for (int tick = 0; tick < 20; ++tick) SayNavigation(tick);
  const auto said = bench_.Said(outputs::kNav);
  ASSERT_EQ(said.size(), 20u);
  const OdometrySample nav = *FromMessage(said.back());
  EXPECT_EQ(ToUtime(nav.time), kStart_us + 1'900'000);
  EXPECT_TRUE(nav.X_OB.translation().isApprox(Vec3(0, 0.38, -2), 1e-6))
      << nav.X_OB.translation().transpose();
  const RollPitchYaw angles = AnglesOf(nav.X_OB);
  EXPECT_NEAR(angles.yaw, std::numbers::pi / 2, 1e-9) << "heading 0 is along y";
  EXPECT_NEAR(angles.roll, 0.01, 1e-9);
  EXPECT_NEAR(angles.pitch, -0.02, 1e-9) << "the bow up is a turn towards -z";
  EXPECT_NEAR(nav.velocity_B_m_s.x(), 0.2, 1e-3) << "found from the poses";
  EXPECT_EQ(bench_.Said(inputs::kVehicleNav).size(), 20u) << "a log keeps them as ours, too";
}

TEST_F(HauvMessagesTest, PartsOfDifferentMomentsAreNoPose) {
  SayNavigation(0, 1);
  EXPECT_TRUE(bench_.Said(outputs::kNav).empty());
}

TEST_F(HauvMessagesTest, InstrumentsBecomeRecords) {
  SayNavigation(0);
  hauv::bs_dvl_2_t dvl{};
  dvl.time = kStart_us;
  dvl.velocity1 = dvl.velocity2 = dvl.velocity3 = dvl.velocity4 = std::nan("");
  Say("HAUV_BS_DVL_2", dvl);
  EXPECT_FALSE(bench_.Last(inputs::kDvl).valid);
  // Forward, with beam 3 ahead: away from where beam 4 points.
  dvl.velocity1 = dvl.velocity2 = 0;
  dvl.velocity3 = -0.1;
  dvl.velocity4 = 0.1;
  Say("HAUV_BS_DVL_2", dvl);
  ASSERT_TRUE(bench_.Last(inputs::kDvl).valid);
  EXPECT_NEAR(std::abs(bench_.Last(inputs::kDvl).velocity_B_m_s[0]), 0.2, 1e-9);
  EXPECT_NEAR(bench_.Last(inputs::kDvl).velocity_B_m_s[1], 0, 1e-9);
  hauv::bs_imu_t imu{};
  imu.time = kStart_us;
  imu.rate_z = 0.1;
  Say("HAUV_BS_IMU", imu);
  EXPECT_NEAR(bench_.Last(inputs::kImu).angular_velocity_B_rad_s[2], -0.1, 1e-9);
  EXPECT_NEAR(bench_.Last(inputs::kImu).pitch_rad, -0.02, 1e-9);
}

TEST_F(HauvMessagesTest, WhatIsNotFiniteOrDamagedIsCounted) {
  hauv::bs_cnv_t cnv{};
  cnv.time_nav = kStart_us;
  cnv.x = std::nan("");
  Say("HAUV_BS_CNV", cnv);
  cnv.x = 0;
  cnv.time_nav = std::numeric_limits<std::int64_t>::max();
  Say("HAUV_BS_CNV", cnv);
  bench_.queue.PublishAt(bench_.queue.now(), "HAUV_BS_RNV_2", std::vector<std::uint8_t>{1, 2, 3});
  bench_.RunFor(std::chrono::seconds(2));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "refused_hauv_messages"), 3);
  EXPECT_TRUE(bench_.Said(outputs::kNav).empty());
}

}  // namespace
}  // namespace vog
