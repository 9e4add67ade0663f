#include "procs/nav_bridge/nav_bridge_node.h"

#include <gtest/gtest.h>

#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

class NavBridgeNodeTest : public testing::Test {
 protected:
  NavBridgeNodeTest() {
    settings_.run_id = Bench::kRun;
    Start();
  }

  void Start() {
    dut_.reset();
    dut_ = std::make_unique<Process<NavBridgeNode>>(bench_.queue, ++epoch_, settings_);
  }

  static Time At(int tick) { return Time(tick * Duration(50000)); }
  static VehicleNavRecord RecordAt(int tick) {
    const double t = 0.05 * tick;
    return {At(tick),
            tick,
            0,
            MakePose({0.2 * t, 0.1 * std::sin(t), -1}, {0.01, 0.02, 0.1 * t}),
            Vec3(0.2, 0, 0.01),
            0.1};
  }
  void SayVehicleNav(int tick) {
    bench_.Say(inputs::kVehicleNav, ToMessage(RecordAt(tick)), At(tick));
    bench_.RunUntil(At(tick));
  }
  void SayControl(const VelocityCommand& command, int tick) {
    bench_.Say(outputs::kControl, ToMessage(command), At(tick));
    bench_.RunUntil(At(tick));
  }
  std::vector<VelocityCommand> Commands() const {
    std::vector<VelocityCommand> commands;
    for (const control_t& message : bench_.Said(outputs::kVehicleCommand))
      commands.push_back(*FromMessage(message));
    return commands;
  }

  Bench bench_;
  NavBridgeSettings settings_;
  std::unique_ptr<Process<NavBridgeNode>> dut_;
  std::int64_t epoch_ = 10;
};

bool IsStop(const VelocityCommand& command) {
  return command.velocity_B_m_s.isZero() && command.yaw_rate_rad_s == 0;
}

void ExpectSame(const OdometrySample& a, const OdometrySample& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.segment, b.segment);
  EXPECT_TRUE(a.X_OB.isApprox(b.X_OB, 1e-9));
  EXPECT_TRUE(a.covariance.isApprox(b.covariance, 1e-12));
  EXPECT_EQ(a.velocity_B_m_s, b.velocity_B_m_s);
  EXPECT_EQ(a.yaw_rate_rad_s, b.yaw_rate_rad_s);
}

TEST_F(NavBridgeNodeTest, TellsTheVehiclesOwnReckoningWithItsCovariance) {
  VehicleNavTracker expected(settings_.drift, settings_.scan_period_s, epoch_);
  for (int tick = 0; tick < 40; ++tick) {
    SayVehicleNav(tick);
    ExpectSame(*FromMessage(bench_.Last(outputs::kNav)), expected.Add(RecordAt(tick)));
  }
  EXPECT_EQ(bench_.Said(outputs::kNav).size(), 40u);
  EXPECT_GT(bench_.Last(outputs::kNav).covariance_xyyaw[0], 0);
}

TEST_F(NavBridgeNodeTest, ReckonsFromInstruments) {
  settings_.bridge.source = NavigationSource::kInstruments;
  Start();
  DeadReckoner expected(settings_.dead_reckoning, epoch_);
  expected.SetFix(RecordAt(0).X_OB);
  SayVehicleNav(0);
  int samples = 0;
  for (int tick = 1; tick < 60; ++tick) {
    const DvlRecord dvl{At(tick), tick, Vec3(0.2, 0.01, 0), tick % 7 != 0};
    const DepthRecord depth{At(tick), tick, 1 + 0.001 * tick};
    const ImuRecord imu{At(tick), tick, 0.01, -0.02, Vec3(0, 0, 0.1)};
    if (tick % 2 == 0) {
      bench_.Say(inputs::kDvl, ToMessage(dvl), At(tick));
      expected.Add(dvl);
    }
    if (tick % 3 == 0) {
      bench_.Say(inputs::kDepth, ToMessage(depth), At(tick));
      expected.Add(depth);
    }
    bench_.Say(inputs::kImu, ToMessage(imu), At(tick));
    bench_.RunUntil(At(tick));
    const auto sample = expected.Add(imu);
    samples += sample.has_value();
    ASSERT_EQ(static_cast<int>(bench_.Said(outputs::kNav).size()), samples);
    if (sample) ExpectSame(*FromMessage(bench_.Last(outputs::kNav)), *sample);
  }
  EXPECT_GT(samples, 50);
  // A fix on the way is none.
  SayVehicleNav(60);
  EXPECT_EQ(static_cast<int>(bench_.Said(outputs::kNav).size()), samples);
}

TEST_F(NavBridgeNodeTest, EachStartIsANewSegment) {
  SayVehicleNav(0);
  SayVehicleNav(1);
  const nav_t before = bench_.Last(outputs::kNav);
  Start();
  SayVehicleNav(2);
  const nav_t after = bench_.Last(outputs::kNav);
  EXPECT_EQ(before.header.epoch + 1, after.header.epoch);
  EXPECT_EQ(before.origin, after.origin) << "the vehicle's computer reckons on";
  EXPECT_EQ(after.covariance_xyyaw[0], 0) << "nothing has drifted since the segment began";
}

TEST_F(NavBridgeNodeTest, NoCommandPassesAboveTheLimits) {
  Random random(1, "command");
  for (int tick = 0; tick < 200; ++tick) {
    const VelocityCommand asked{random.GaussianVector(Vec3::Constant(0.3)), random.Gaussian(0.3)};
    SayControl(asked, tick);
    const VelocityCommand passed = Commands().back();
    EXPECT_LE(passed.velocity_B_m_s.norm(), settings_.bridge.max_speed_m_s + 1e-12);
    EXPECT_LE(std::abs(passed.yaw_rate_rad_s), settings_.bridge.max_yaw_rate_rad_s);
    EXPECT_LT(passed.velocity_B_m_s.cross(asked.velocity_B_m_s).norm(), 1e-9);
    EXPECT_GT(passed.velocity_B_m_s.dot(asked.velocity_B_m_s), 0);
    if (asked.velocity_B_m_s.norm() < settings_.bridge.max_speed_m_s) {
      EXPECT_EQ(passed.velocity_B_m_s, asked.velocity_B_m_s);
    }
    if (std::abs(asked.yaw_rate_rad_s) < settings_.bridge.max_yaw_rate_rad_s) {
      EXPECT_EQ(passed.yaw_rate_rad_s, asked.yaw_rate_rad_s);
    }
  }
  EXPECT_EQ(Commands().size(), 200u);
}

TEST_F(NavBridgeNodeTest, StopsTheVehicleOnceWhenCommandsEnd) {
  settings_.bridge.command_timeout_s = 0.5;
  Start();
  const VelocityCommand forward{Vec3(0.2, 0, 0), 0.1};
  SayControl(forward, 0);
  for (int tick = 1; tick <= 10; ++tick) SayVehicleNav(tick);  // Up to 0.5 s.
  EXPECT_EQ(Commands().size(), 1u);
  for (int tick = 11; tick <= 60; ++tick) SayVehicleNav(tick);
  ASSERT_EQ(Commands().size(), 2u);
  EXPECT_TRUE(IsStop(Commands().back()));
  EXPECT_GT(TimeOf(bench_.Last(outputs::kVehicleCommand).header), At(10));
  EXPECT_LE(TimeOf(bench_.Last(outputs::kVehicleCommand).header), At(13));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "watchdog_stops"), 1);
  // And goes on with the next one.
  SayControl(forward, 61);
  SayVehicleNav(62);
  EXPECT_EQ(Commands().size(), 3u);
  EXPECT_FALSE(IsStop(Commands().back()));
  for (int tick = 63; tick <= 80; ++tick) SayVehicleNav(tick);
  EXPECT_TRUE(IsStop(Commands().back()));
}

TEST_F(NavBridgeNodeTest, HoldsTheVehicleWhileTheBottomIsLost) {
  settings_.bridge.source = NavigationSource::kInstruments;
  Start();
  constexpr int kLostFrom = 40, kLostTo = 120;
  std::vector<std::size_t> told;  // Until each tick.
  for (int tick = 0; tick < 160; ++tick) {
    const bool lost = tick >= kLostFrom && tick < kLostTo;
    const DvlRecord dvl{At(tick), tick, lost ? Vec3::Zero() : Vec3(0.2, 0, 0), !lost};
    bench_.Say(inputs::kDvl, ToMessage(dvl), At(tick));
    bench_.Say(inputs::kDepth, ToMessage(DepthRecord{At(tick), tick, 1}), At(tick));
    bench_.Say(inputs::kImu, ToMessage(ImuRecord{At(tick), tick, 0, 0, Vec3::Zero()}), At(tick));
    SayControl({Vec3(0.2, 0, 0), 0.1}, tick);
    told.push_back(bench_.Said(outputs::kNav).size());
    if (tick == kLostTo - 1) {
      EXPECT_EQ(bench_.StatusOf("vog-nav-bridge").health, "no bottom lock");
    }
  }
  const std::vector<VelocityCommand> commands = Commands();
  ASSERT_EQ(commands.size(), 160u);
  const int grace = 20;  // dead_reckoning.lock_lost_after_s
  for (int tick = 0; tick < 160; ++tick)
    EXPECT_EQ(IsStop(commands[tick]), tick >= kLostFrom + grace && tick < kLostTo) << tick;
  for (int tick = 1; tick < 160; ++tick)
    EXPECT_EQ(told[tick] > told[tick - 1], tick < kLostFrom + grace || tick >= kLostTo) << tick;
  bench_.RunUntil(At(180));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "held_commands"), kLostTo - kLostFrom - grace);
}

// The vehicle's clock is its own.
TEST_F(NavBridgeNodeTest, ACommandIsAsOldAsItsWayFromItsArrival) {
  control_t command = ToMessage(VelocityCommand{Vec3(0.2, 0, 0), 0});
  const auto say = [&](Time told, int tick) {
    command.header = bench_.NextHeader(outputs::kControl.name, told);
    bench_.SayAsIs(outputs::kControl, command, At(tick));
    bench_.RunUntil(At(tick + 1));
  };
  for (int tick = 0; tick < 10; ++tick) say(At(tick) + std::chrono::hours(1), tick);
  EXPECT_EQ(Commands().size(), 10u);
  bench_.RunUntil(At(40));
  ASSERT_EQ(Commands().size(), 11u);
  EXPECT_TRUE(IsStop(Commands().back()));
}

TEST_F(NavBridgeNodeTest, StopsTheVehicleWithoutNavigationToo) {
  SayControl({Vec3(0.2, 0, 0), 0}, 0);
  bench_.RunUntil(At(40));
  ASSERT_EQ(Commands().size(), 2u);
  EXPECT_TRUE(IsStop(Commands().back()));
  EXPECT_EQ(bench_.StatusOf("vog-nav-bridge").health, "no navigation");
}

TEST_F(NavBridgeNodeTest, ImpossibleValuesAreCountedAndPassNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  settings_.bridge.source = NavigationSource::kInstruments;
  Start();
  SayControl({Vec3(nan, 0, 0), 0}, 1);
  SayControl({Vec3(0, 0, 0), nan}, 1);
  VehicleNavRecord record = RecordAt(1);
  record.velocity_B_m_s.x() = nan;
  bench_.Say(inputs::kVehicleNav, ToMessage(record), At(1));
  bench_.Say(inputs::kDvl, ToMessage(DvlRecord{At(1), 1, Vec3(0, nan, 0), true}), At(1));
  bench_.Say(inputs::kDepth, ToMessage(DepthRecord{At(1), 1, nan}), At(1));
  bench_.Say(inputs::kImu, ToMessage(ImuRecord{At(1), 1, nan, 0, Vec3::Zero()}), At(1));
  bench_.RunUntil(At(40));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "malformed"), 6);
  EXPECT_TRUE(Commands().empty());
  EXPECT_TRUE(bench_.Said(outputs::kNav).empty());
}

TEST_F(NavBridgeNodeTest, DamagedBytesAreCountedAndHarmless) {
  Random random(2, "damage");
  int damaged = SayDamaged(bench_, inputs::kVehicleNav, ToMessage(RecordAt(0)), random);
  damaged += SayDamaged(bench_, outputs::kControl, control_t{}, random);
  damaged += SayDamaged(bench_, inputs::kDvl, dvl_t{}, random);
  damaged += SayDamaged(bench_, inputs::kImu, imu_t{}, random);
  damaged += SayDamaged(bench_, inputs::kDepth, depth_t{}, random);
  bench_.RunUntil(At(30));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "malformed") +
                bench_.CounterOf("vog-nav-bridge", "other_run"),
            damaged);
  EXPECT_TRUE(Commands().empty());
  SayVehicleNav(31);
  EXPECT_EQ(bench_.Said(outputs::kNav).size(), 1u);
}

TEST_F(NavBridgeNodeTest, CommandsOfAnOldControllerOrAnotherRunDoNotPass) {
  SayControl({Vec3(0.1, 0, 0), 0}, 1);
  control_t old = ToMessage(VelocityCommand{Vec3(0.2, 0, 0), 0});
  old.header = bench_.NextHeader(outputs::kControl.name, At(2));
  old.header.epoch -= 1;
  bench_.SayAsIs(outputs::kControl, old, At(2));
  old.header.epoch += 1;
  old.header.run_id += 1;
  bench_.SayAsIs(outputs::kControl, old, At(2));
  bench_.RunUntil(At(5));
  EXPECT_EQ(Commands().size(), 1u);
  bench_.RunUntil(At(30));
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "stale"), 1);
  EXPECT_EQ(bench_.CounterOf("vog-nav-bridge", "other_run"), 1);
}

}  // namespace
}  // namespace vog
