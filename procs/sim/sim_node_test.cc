#include "procs/sim/sim_node.h"

#include <gtest/gtest.h>

#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

const char* const kMission = R"(
[mission]
seed = 5
mode = "vog-no-lc"
[scene]
kind = "tank"
[scene.tank]
max_edge_m = 2
facets = 16
ladder_rungs = 2
[simulation]
start_position_m = [0.0, 0.0, 0.0]
start_yaw_deg = 0.0
[sonar]
beams = 16
max_range_m = 5.0
[sonar_model]
emits = "returns"
[bus]
run_id = 7
)";

SimSettings Settings(const std::vector<std::string>& overrides = {}) {
  Config config = Config::Parse(kMission, "test");
  for (const std::string& setting : overrides) config.Set(setting);
  return SimSettings::From(config);
}

class SimNodeTest : public testing::Test {
 protected:
  explicit SimNodeTest(const SimSettings& settings = Settings())
      : bus_(bench_.queue, "dut", 10), dut_(bus_, settings) {}

  void RunTo(double seconds) {
    for (Time next = dut_.next_due(); next <= Time(FromSeconds(seconds)); next = dut_.next_due()) {
      bench_.RunUntil(next);
      dut_.AdvanceTo(next);
    }
    bench_.RunUntil(Time(FromSeconds(seconds)));
  }
  void Command(const VelocityCommand& command) {
    bench_.Say(outputs::kVehicleCommand, ToMessage(command), bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  Vec3 TruePosition() const { return FromMessage(bench_.Last(inputs::kTruth).X_WB)->translation(); }

  Bench bench_;
  ProcessBus bus_;
  SimNode dut_;
};

TEST_F(SimNodeTest, TellsTheRunAgainForThoseWhoMissedIt) {
  dut_.AdvanceTo(Time{});
  RunTo(21);
  const auto runs = bench_.Said(inputs::kRun);
  ASSERT_EQ(runs.size(), 3u);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    EXPECT_NEAR(ToSeconds(TimeOf(runs[i].header)), 10.0 * static_cast<double>(i), 0.3);
    EXPECT_EQ(runs[i].config_toml, runs[0].config_toml);
  }
}

TEST_F(SimNodeTest, TellsTheRunFirst) {
  dut_.AdvanceTo(Time{});
  RunTo(1);
  const auto runs = bench_.Said(inputs::kRun);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].seed, 5);
  EXPECT_EQ(runs[0].mode, "vog-no-lc");
  EXPECT_EQ(runs[0].header.run_id, 7);
  EXPECT_EQ(runs[0].header.sequence, 0);
  // It holds all settings: a simulator made of them is the same.
  const Config again = Config::Parse(runs[0].config_toml, "run");
  EXPECT_EQ(again.Read<SonarOptions>("sonar").beams, 16);
  EXPECT_EQ(again.ToToml(), runs[0].config_toml);
}

TEST_F(SimNodeTest, TellsEachInstrumentAtItsRate) {
  dut_.AdvanceTo(Time{});
  RunTo(4);
  EXPECT_NEAR(static_cast<double>(bench_.Said(inputs::kSonarReturns).size()), 4 * 5 + 1, 1);
  EXPECT_GE(bench_.Said(inputs::kVehicleNav).size(), 40u);
  EXPECT_TRUE(bench_.Said(inputs::kImu).empty());
  EXPECT_GE(bench_.Said(inputs::kTruth).size(), 20u);
  std::int64_t last_us = -1;
  for (const vehicle_nav_t& message : bench_.Said(inputs::kVehicleNav)) {
    EXPECT_GT(message.header.utime_us, last_us);
    last_us = message.header.utime_us;
    EXPECT_TRUE(FromMessage(message).has_value());
  }
  int echoes = 0;
  for (const sonar_returns_t& message : bench_.Said(inputs::kSonarReturns)) {
    ASSERT_EQ(message.beams, 16);
    echoes += static_cast<int>(std::count_if(message.range_m.begin(), message.range_m.end(),
                                             [](float range_m) { return range_m > 0; }));
  }
  EXPECT_GT(echoes, 50) << "the tank's wall is in sight";
}

TEST_F(SimNodeTest, ObeysCommandsAndStopsWithoutThem) {
  dut_.AdvanceTo(Time{});
  RunTo(2);
  EXPECT_LT(TruePosition().norm(), 0.2) << "holds its place at first";
  const double before_m = TruePosition().x();
  for (int i = 0; i < 50; ++i) {
    Command({Vec3(0.2, 0, 0), 0});
    EXPECT_EQ(dut_.commanded(), bench_.queue.now());
    RunTo(2 + 0.1 * (i + 1));
  }
  EXPECT_NEAR(TruePosition().x() - before_m, 0.2 * 5, 0.25);
  RunTo(12);
  const double rest_m = TruePosition().x();
  RunTo(14);
  EXPECT_NEAR(TruePosition().x(), rest_m, 0.02);
}

TEST_F(SimNodeTest, ImpossibleAndDamagedCommandsAreCountedAndIgnored) {
  dut_.AdvanceTo(Time{});
  Random random(1, "damage");
  const int damaged = SayDamaged(bench_, outputs::kVehicleCommand, control_t{}, random);
  Command({Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0), 0});
  Command({Vec3(0, 0, 0), std::numeric_limits<double>::infinity()});
  control_t foreign = ToMessage(VelocityCommand{Vec3(0.3, 0, 0), 0});
  foreign.header = bench_.NextHeader(outputs::kVehicleCommand.name, bench_.queue.now());
  foreign.header.run_id += 1;
  bench_.SayAsIs(outputs::kVehicleCommand, foreign, bench_.queue.now());
  RunTo(3);
  EXPECT_TRUE(TruePosition().allFinite());
  EXPECT_LT(TruePosition().norm(), 0.3);
  EXPECT_EQ(bench_.CounterOf("vog-sim", "malformed") + bench_.CounterOf("vog-sim", "other_run"),
            damaged + 3);
  EXPECT_GE(bench_.CounterOf("vog-sim", "vehicle_time_s"), 2);
}

TEST(SimNodeRepeatTest, EqualSeedsAndCommandsGiveEqualBytes) {
  const auto said = [](const std::string& seed) {
    Bench bench;
    ProcessBus bus(bench.queue, "dut", 10);
    SimNode dut(bus, Settings({"mission.seed=" + seed}));
    dut.AdvanceTo(Time{});
    for (int i = 0; i < 40; ++i) {
      if (i == 10)
        bench.Say(outputs::kVehicleCommand, ToMessage(VelocityCommand{Vec3(0.1, 0.1, 0), 0.1}),
                  bench.queue.now());
      bench.RunUntil(dut.next_due());
      dut.AdvanceTo(bench.queue.now());
    }
    bench.RunFor(Duration(1));
    return bench.said();
  };
  const auto a = said("5"), b = said("5"), c = said("6");
  EXPECT_EQ(a, b);
  EXPECT_NE(a.at(inputs::kVehicleNav.name), c.at(inputs::kVehicleNav.name));
}

TEST(SimNodeSensorsTest, InstrumentsReplaceTheVehiclesReckoning) {
  Bench bench;
  ProcessBus bus(bench.queue, "dut", 10);
  SimNode dut(bus, Settings({"simulation.navigation=sensors"}));
  dut.AdvanceTo(Time{});
  for (int i = 0; i < 60; ++i) dut.AdvanceTo(dut.next_due());
  bench.RunFor(Duration(1));
  EXPECT_GT(bench.Said(inputs::kImu).size(), 10u);
  EXPECT_GT(bench.Said(inputs::kDvl).size(), 3u);
  EXPECT_GT(bench.Said(inputs::kDepth).size(), 5u);
  EXPECT_LE(bench.Said(inputs::kVehicleNav).size(), 1u) << "one fix";
}

TEST(SimSettingsTest, RefusesAMissingScene) {
  EXPECT_THROW(Settings({"scene.kind=mesh", "scene.mesh=\"/nowhere.stl\""}), UsageError);
}

/// A live simulator, paced by the bench's clock.
class LivePacerTest : public SimNodeTest {
 protected:
  LivePacerTest() : SimNodeTest(Settings({"live.speed=2.0", "live.stall_s=2.0"})) {
    pacer_ = std::make_unique<LivePacer>(bus_, dut_, settings_.live);
  }
  double VehicleSeconds() const { return ToSeconds(dut_.time()); }
  /// Answers each pose at once, as the vehicle's processes do.
  void RunAnswering(Duration duration) {
    const Time end = bench_.queue.now() + duration;
    while (bench_.queue.now() < end) {
      control_t command = ToMessage(VelocityCommand{});
      command.header = bench_.NextHeader(outputs::kVehicleCommand.name, dut_.time());
      bench_.SayAsIs(outputs::kVehicleCommand, command, bench_.queue.now());
      bench_.RunFor(std::chrono::milliseconds(10));
    }
  }

  const SimSettings settings_ = Settings({"live.speed=2.0", "live.stall_s=2.0"});
  std::unique_ptr<LivePacer> pacer_;
};

TEST_F(LivePacerTest, GoesAtItsSpeedWhileItIsAnswered) {
  RunAnswering(std::chrono::seconds(3));
  EXPECT_NEAR(VehicleSeconds(), 6, 0.3);
  EXPECT_EQ(bench_.Said(inputs::kRun).size(), 1u);
}

TEST_F(LivePacerTest, WaitsForAnAnswerAndGoesOnWhenThereIsNone) {
  RunAnswering(std::chrono::seconds(1));
  const double before_s = VehicleSeconds();
  bench_.RunFor(std::chrono::milliseconds(1500));
  EXPECT_LE(VehicleSeconds(), before_s + settings_.live.max_ahead_s + 0.11);
  bench_.RunFor(std::chrono::milliseconds(5000));
  EXPECT_GT(VehicleSeconds(), before_s + 2) << "nobody answers: time goes on";
  // In real time, not faster.
  const double stalled_s = VehicleSeconds();
  bench_.RunFor(std::chrono::seconds(4));
  EXPECT_NEAR(VehicleSeconds() - stalled_s, 4, 1);
  // What was waited away is not made up for.
  const double resumed_s = VehicleSeconds();
  RunAnswering(std::chrono::seconds(2));
  EXPECT_NEAR(VehicleSeconds() - resumed_s, 4, 0.6);
}

}  // namespace
}  // namespace vog
