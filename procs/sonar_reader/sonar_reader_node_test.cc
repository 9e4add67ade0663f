#include "procs/sonar_reader/sonar_reader_node.h"

#include <gtest/gtest.h>

#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

class SonarReaderNodeTest : public testing::Test {
 protected:
  SonarReaderNodeTest() {
    settings_.run_id = Bench::kRun;
    settings_.sonar.beams = 32;
    dut_ = std::make_unique<Process<SonarReaderNode>>(bench_.queue, 10, settings_);
  }

  static Time At(int tick) { return Time(tick * Duration(200000)); }
  SonarReturns ReturnsAt(int tick) const {
    Random random(1, "returns", static_cast<std::uint64_t>(tick));
    SonarReturns returns{At(tick), tick, 0.1 * tick, 0.5, 10, {}, {}};
    for (int i = 0; i < settings_.sonar.beams; ++i) {
      const bool silent = random.Chance(0.5);
      returns.range_m.push_back(silent ? 0 : static_cast<float>(random.Uniform(0.2, 11)));
      returns.strength.push_back(static_cast<float>(random.Uniform(0, 1)));
    }
    return returns;
  }
  SonarFrame FrameAt(int tick) const {
    Random random(2, "frame", static_cast<std::uint64_t>(tick));
    SonarFrame frame{At(tick), tick, 0.2, 0.5, 10.5, settings_.sonar.beams, 200, {}};
    for (int bin = 0; bin < frame.bins; ++bin)
      for (int beam = 0; beam < frame.beams; ++beam) {
        const bool is_echo = beam < 12 && std::abs(bin - 100 - beam) < 2;
        frame.samples.push_back(static_cast<std::uint8_t>(is_echo ? 220 : random.Index(12)));
      }
    return frame;
  }
  void ExpectSame(const Scan& a, const Scan& b) const {
    EXPECT_EQ(a.time, b.time);
    EXPECT_TRUE(a.X_BS.isApprox(b.X_BS, 1e-9));
    EXPECT_EQ(a.min_range_m, b.min_range_m);
    EXPECT_EQ(a.max_range_m, b.max_range_m);
    ASSERT_EQ(a.beams.size(), b.beams.size());
    for (std::size_t i = 0; i < a.beams.size(); ++i) {
      EXPECT_EQ(a.beams[i].bearing_rad, b.beams[i].bearing_rad);
      EXPECT_EQ(a.beams[i].range_m, b.beams[i].range_m);
      EXPECT_EQ(a.beams[i].strength, b.beams[i].strength);
      EXPECT_EQ(a.beams[i].status, b.beams[i].status) << i;
    }
  }

  Bench bench_;
  SonarReaderSettings settings_;
  std::unique_ptr<Process<SonarReaderNode>> dut_;
};

TEST_F(SonarReaderNodeTest, TurnsReturnsIntoScans) {
  const auto bearings = BeamBearings(settings_.sonar);
  for (int tick = 0; tick < 20; ++tick) {
    const SonarReturns returns = ReturnsAt(tick);
    bench_.Say(inputs::kSonarReturns, ToMessage(returns), At(tick));
    bench_.RunUntil(At(tick));
    Scan expected{At(tick), tick, SonarPose(settings_.sonar, returns.tilt_rad), 0.5, 10, {}};
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      const float range_m = returns.range_m[i];
      const bool echo = range_m >= 0.5 && range_m <= 10;
      expected.beams.push_back({static_cast<float>(bearings[i]), echo ? range_m : 0,
                                returns.strength[i],
                                echo ? BeamStatus::kReturn : BeamStatus::kUncertain});
    }
    ClassifySilentBeams(settings_.range_detector.guard_beams, expected.beams);
    ExpectSame(*FromMessage(bench_.Last(outputs::kScan)), expected);
  }
  EXPECT_EQ(bench_.Said(outputs::kScan).size(), 20u);
}

TEST_F(SonarReaderNodeTest, FindsTheEchoesOfFrames) {
  const SonarFrame frame = FrameAt(1);
  bench_.Say(inputs::kSonarFrame, ToMessage(frame), At(1));
  bench_.RunUntil(At(1));
  const Scan scan = *FromMessage(bench_.Last(outputs::kScan));
  ExpectSame(scan, {At(1), 1, SonarPose(settings_.sonar, 0.2), 0.5, 10.5,
                    DetectRanges(settings_.range_detector, frame, BeamBearings(settings_.sonar))});
  for (int beam = 0; beam < 12; ++beam) {
    EXPECT_EQ(scan.beams[beam].status, BeamStatus::kReturn);
    EXPECT_NEAR(scan.beams[beam].range_m, 0.5 + 0.05 * (100 + beam), 0.15);
  }
  EXPECT_EQ(scan.beams[31].status, BeamStatus::kClear);
}

TEST_F(SonarReaderNodeTest, AnotherNumberOfBeamsIsTold) {
  SonarReturns returns = ReturnsAt(0);
  returns.range_m.pop_back();
  returns.strength.pop_back();
  bench_.Say(inputs::kSonarReturns, ToMessage(returns), At(0));
  SonarFrame frame = FrameAt(1);
  frame.beams *= 2;
  frame.bins /= 2;
  bench_.Say(inputs::kSonarFrame, ToMessage(frame), At(1));
  bench_.RunUntil(At(6));
  EXPECT_TRUE(bench_.Said(outputs::kScan).empty());
  EXPECT_EQ(bench_.CounterOf("vog-sonar-reader", "other_beams"), 2);
  EXPECT_NE(bench_.StatusOf("vog-sonar-reader").health.find("number of beams"), std::string::npos);
}

TEST_F(SonarReaderNodeTest, ImpossibleValuesAreCountedAndHarmless) {
  const auto say = [&](auto change) {
    SonarReturns returns = ReturnsAt(0);
    change(returns);
    bench_.Say(inputs::kSonarReturns, ToMessage(returns), bench_.queue.now());
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  say([&](SonarReturns& r) { r.range_m[3] = nan; });
  say([&](SonarReturns& r) { r.strength[3] = std::numeric_limits<float>::infinity(); });
  say([&](SonarReturns& r) { r.tilt_rad = nan; });
  say([&](SonarReturns& r) { r.max_range_m = r.min_range_m; });
  say([&](SonarReturns& r) { r.min_range_m = -1; });
  sonar_frame_t frame = ToMessage(FrameAt(0));
  frame.bins += 1;
  bench_.Say(inputs::kSonarFrame, frame, bench_.queue.now());
  frame.bins = frame.beams = -1;
  bench_.Say(inputs::kSonarFrame, frame, bench_.queue.now());
  bench_.RunUntil(At(6));
  EXPECT_EQ(bench_.CounterOf("vog-sonar-reader", "malformed"), 7);
  EXPECT_TRUE(bench_.Said(outputs::kScan).empty());
  // A range below zero is no echo.
  say([](SonarReturns& r) { std::fill(r.range_m.begin(), r.range_m.end(), -5.0f); });
  bench_.RunUntil(At(7));
  for (const std::int8_t status : bench_.Last(outputs::kScan).status)
    EXPECT_EQ(status, static_cast<int>(BeamStatus::kClear));
}

TEST_F(SonarReaderNodeTest, DamagedBytesAreCountedAndHarmless) {
  Random random(3, "damage");
  int damaged = SayDamaged(bench_, inputs::kSonarReturns, ToMessage(ReturnsAt(0)), random);
  damaged += SayDamaged(bench_, inputs::kSonarFrame, ToMessage(FrameAt(0)), random);
  bench_.Say(inputs::kSonarReturns, ToMessage(ReturnsAt(3)), At(3));
  bench_.RunUntil(At(6));
  EXPECT_EQ(bench_.CounterOf("vog-sonar-reader", "malformed") +
                bench_.CounterOf("vog-sonar-reader", "other_run"),
            damaged);
  EXPECT_EQ(bench_.Said(outputs::kScan).size(), 1u);
}

TEST_F(SonarReaderNodeTest, TheSameReturnsAgainAreStale) {
  sonar_returns_t message = ToMessage(ReturnsAt(0));
  message.header = bench_.NextHeader(inputs::kSonarReturns.name, At(0));
  for (int i = 0; i < 3; ++i) bench_.SayAsIs(inputs::kSonarReturns, message, At(0));
  bench_.RunUntil(At(6));
  EXPECT_EQ(bench_.Said(outputs::kScan).size(), 1u);
  EXPECT_EQ(bench_.CounterOf("vog-sonar-reader", "stale"), 2);
}

TEST(SonarReaderSettingsTest, RefusesAnEmptyWindow) {
  EXPECT_THROW(
      SonarReaderSettings::From(Config::Parse("[sonar]\nmin_range_m = 5\nmax_range_m = 4", "a")),
      UsageError);
}

}  // namespace
}  // namespace vog
