#include <gtest/gtest.h>

#include "hardware/link/loopback_links.h"
#include "hardware/sonar/didson_stream.h"
#include "procs/map_service/node_testing.h"
#include "procs/nav_bridge/nav_bridge_node.h"
#include "procs/sim/front_seat.h"
#include "procs/sonar_reader/sonar_reader_node.h"

// The simulator's end of the wires and the readers' end, joined.

namespace vog {
namespace {

constexpr std::int64_t kDay_us = 86'400'000'000;

/// Both ends of a vehicle's wire, and a hand on it.
struct Wire {
  std::unique_ptr<FrontSeat> front_seat;
  std::unique_ptr<VehicleLink> link;
};

Wire MakeWire(VehicleProtocol protocol) {
  if (protocol == VehicleProtocol::kCan) {
    auto [a, b] = MakeCanLoopback();
    return {MakeCanFrontSeat(std::move(a)), MakeCanVehicle(std::move(b))};
  }
  auto [a, b] = MakeLoopback();
  return {MakeBluefinFrontSeat(std::move(a), {}), MakeBluefinVehicle(std::move(b), {{}, {}})};
}

class WireTest : public testing::TestWithParam<VehicleProtocol> {
 protected:
  WireTest() : wire_(MakeWire(GetParam())) {}

  /// A moment that Bluefin's milliseconds can tell, in whatever day.
  static Time At(int tick) { return FromUtime(kDay_us * 20'000 - 2'000'000 + 100'000 * tick); }
  static VehicleNavRecord RecordAt(int tick) {
    Random random(1, "nav", static_cast<std::uint64_t>(tick));
    VehicleNavRecord record;
    record.time = At(tick);
    record.X_OB =
        MakePose({random.Uniform(-20, 20), random.Uniform(-20, 20), random.Uniform(-9, 0)},
                 {random.Uniform(-0.1, 0.1), random.Uniform(-0.1, 0.1), random.Uniform(-3, 3)});
    record.velocity_B_m_s = {random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), 0.05};
    record.yaw_rate_rad_s = random.Uniform(-0.2, 0.2);
    return record;
  }
  std::vector<NavigationRecord> Tell(const Emissions& emissions) {
    wire_.front_seat->Tell(emissions);
    return wire_.link->Step(Time{}, At(0));
  }
  static Emissions With(const VehicleNavRecord& record) {
    Emissions emissions;
    emissions.navigation = {record};
    return emissions;
  }

  Wire wire_;
};

TEST_P(WireTest, ReckonedPosesPass) {
  for (int tick = 0; tick < 200; ++tick) {
    const VehicleNavRecord sent = RecordAt(tick);
    const auto heard = Tell(With(sent));
    ASSERT_EQ(heard.size(), 1u) << tick;
    const auto& record = std::get<VehicleNavRecord>(heard[0]);
    EXPECT_EQ(record.time, sent.time);
    EXPECT_LT((record.X_OB.translation() - sent.X_OB.translation()).norm(), 2e-3);
    EXPECT_LT(Log(Ominus(sent.X_OB, record.X_OB)).tail<3>().norm(), 1e-3);
    EXPECT_LT((record.velocity_B_m_s - sent.velocity_B_m_s).norm(), 2e-3);
    EXPECT_NEAR(record.yaw_rate_rad_s, sent.yaw_rate_rad_s, 1e-3);
  }
}

TEST_P(WireTest, InstrumentsPass) {
  Random random(2, "instruments");
  for (int tick = 0; tick < 200; ++tick) {
    const auto vector = [&] {
      return Vec3(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2));
    };
    Emissions sent;
    sent.dvl = {{At(tick), 0, Vec3(0.1 * vector()), random.Chance(0.8)}};
    sent.depth = {{At(tick), 0, random.Uniform(0, 30)}};
    sent.imu = {
        {At(tick), 0, random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), Vec3(0.1 * vector())}};
    const auto heard = Tell(sent);
    ASSERT_EQ(heard.size(), 3u);
    const auto& dvl = std::get<DvlRecord>(heard[0]);
    EXPECT_EQ(dvl.time, At(tick));
    EXPECT_EQ(dvl.valid, sent.dvl[0].valid);
    if (dvl.valid) {
      EXPECT_LT((dvl.velocity_B_m_s - sent.dvl[0].velocity_B_m_s).norm(), 2e-3);
    }
    const auto& depth = std::get<DepthRecord>(heard[1]);
    EXPECT_EQ(depth.time, At(tick));
    EXPECT_NEAR(depth.depth_m, sent.depth[0].depth_m, 5e-3);
    const auto& imu = std::get<ImuRecord>(heard[2]);
    EXPECT_EQ(imu.time, At(tick));
    EXPECT_NEAR(imu.roll_rad, sent.imu[0].roll_rad, 1e-3);
    EXPECT_NEAR(imu.pitch_rad, sent.imu[0].pitch_rad, 1e-3);
    EXPECT_LT((imu.angular_velocity_B_rad_s - sent.imu[0].angular_velocity_B_rad_s).norm(), 1e-3);
  }
}

TEST_P(WireTest, CommandsPassAndSayWhatTheyAnswer) {
  Random random(3, "commands");
  for (int tick = 0; tick < 200; ++tick) {
    Tell(With(RecordAt(tick)));
    const VelocityCommand sent{
        {random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3)},
        random.Uniform(-0.2, 0.2)};
    wire_.link->Send(sent, At(tick));
    const auto heard = wire_.front_seat->Step(Time{});
    ASSERT_TRUE(heard);
    EXPECT_EQ(heard->answered, At(tick));
    EXPECT_LT((heard->velocities.velocity_B_m_s - sent.velocity_B_m_s).norm(), 4e-3);
    EXPECT_NEAR(heard->velocities.yaw_rate_rad_s, sent.yaw_rate_rad_s, 2e-3);
  }
  EXPECT_FALSE(wire_.front_seat->Step(Time{}));
}

TEST_P(WireTest, TheBridgeTellsAndObeysAsOverMessages) {
  Bench bench;
  NavBridgeSettings settings;
  settings.run_id = Bench::kRun;
  settings.bridge.max_speed_m_s = 0.2;
  bench.queue.RunUntil(At(0) - Duration(1));
  ProcessBus bus(bench.queue, "dut", 10);
  NavBridgeNode dut(bus, settings, std::move(wire_.link));
  std::optional<FrontSeat::Command> obeyed;
  for (int tick = 0; tick < 40; ++tick) {
    wire_.front_seat->Tell(With(RecordAt(0)));  // It stands still.
    bench.Say(outputs::kControl, ToMessage(VelocityCommand{{5, 0, 0}, 0}), At(tick));
    bench.RunUntil(At(tick));
    if (const auto command = wire_.front_seat->Step(Time{})) obeyed = command;
  }
  EXPECT_EQ(bench.Said(inputs::kVehicleNav).size(),
            bench.Said(outputs::kNav).size() + bench.CounterOf("vog-nav-bridge", "stale"));
  EXPECT_GE(bench.Said(outputs::kNav).size(), 1u);
  ASSERT_TRUE(obeyed);
  EXPECT_NEAR(obeyed->velocities.velocity_B_m_s.norm(), 0.2, 3e-3) << "the limit";
  // Nobody commands: the vehicle is told to stop.
  bench.RunUntil(At(60));
  obeyed = wire_.front_seat->Step(Time{});
  ASSERT_TRUE(obeyed);
  EXPECT_LT(obeyed->velocities.velocity_B_m_s.norm(), 3e-3);
}

INSTANTIATE_TEST_SUITE_P(Protocols, WireTest,
                         testing::Values(VehicleProtocol::kCan, VehicleProtocol::kBluefin));

/// A byte link on which each datagram comes whole.
class DatagramQueue final : public ByteLink {
 public:
  explicit DatagramQueue(std::shared_ptr<std::deque<ByteVector>> queue)
      : queue_(std::move(queue)) {}
  int fd() const override { return -1; }
  void Step(Time) override {}
  ByteRead Read(std::span<std::uint8_t> into) override {
    if (queue_->empty()) return {};
    const ByteVector datagram = queue_->front();
    queue_->pop_front();
    std::copy(datagram.begin(), datagram.end(), into.begin());
    return {ReadOutcome::kData, datagram.size(), {}};
  }
  void Write(std::span<const std::uint8_t>) override {}

 private:
  std::shared_ptr<std::deque<ByteVector>> queue_;
};

SonarFrame FrameAt(int tick) {
  Random random(4, "frame", static_cast<std::uint64_t>(tick));
  SonarFrame frame{Time(tick * Duration(200'000)), tick, 0.25, 0.375, 9.375, 96, 512, {}};
  for (int bin = 0; bin < frame.bins; ++bin)
    for (int beam = 0; beam < frame.beams; ++beam)
      frame.samples.push_back(static_cast<std::uint8_t>(
          std::abs(bin - 200) < 4 && beam > 20 && beam < 60 ? 200 : random.Index(10)));
  return frame;
}

TEST(SonarWireTest, FramesBecomeTheScansThatTheyAre) {
  for (const DidsonPacking packing : {DidsonPacking::kHuls3, DidsonPacking::kHauv1b}) {
    Bench bench;
    SonarReaderSettings settings;
    settings.run_id = Bench::kRun;
    const auto queue = std::make_shared<std::deque<ByteVector>>();
    ProcessBus bus(bench.queue, "dut", 10);
    SonarReaderNode dut(bus, settings, std::make_unique<DatagramQueue>(queue));
    std::uint16_t sequence = 65'530;  // It wraps.
    constexpr int kFrames = 12, kDamaged = 7;
    for (int tick = 1; tick <= kFrames; ++tick) {
      const auto datagrams = EncodeDatagrams(packing, *FromSonarFrame(FrameAt(tick)), sequence);
      sequence = static_cast<std::uint16_t>(sequence + datagrams.size());
      queue->insert(queue->end(), datagrams.begin() + (tick == kDamaged ? 1 : 0), datagrams.end());
      queue->push_back({1, 2, 3});
      bench.RunUntil(FrameAt(tick).time);
    }
    bench.RunFor(std::chrono::seconds(1));
    const auto scans = bench.Said(outputs::kScan);
    ASSERT_EQ(scans.size(), kFrames - 1u);
    for (const scan_t& message : scans) {
      const Scan scan = *FromMessage(message);
      const SonarFrame frame =
          FrameAt(static_cast<int>(scan.time.time_since_epoch().count() / 200'000));
      const auto expected =
          DetectRanges(settings.range_detector, frame, BeamBearings(settings.sonar));
      ASSERT_EQ(scan.beams.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_FLOAT_EQ(scan.beams[i].range_m, expected[i].range_m);
      EXPECT_TRUE(scan.X_BS.isApprox(SonarPose(settings.sonar, 0.25), 1e-5));
    }
    EXPECT_EQ(bench.CounterOf("vog-sonar-reader", "frames"), kFrames - 1);
    EXPECT_EQ(bench.CounterOf("vog-sonar-reader", "datagrams_malformed"), kFrames);
  }
}

}  // namespace
}  // namespace vog
