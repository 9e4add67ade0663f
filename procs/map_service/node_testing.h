#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lib/base/random.h"
#include "lib/bus/queue_bus.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "lib/scan/sonar.h"

/// What the tests of the processes share.
namespace vog {

/// One start of a process on a QueueBus: it has an epoch of its own, may lose what it should hear,
/// and hears nothing more once it is destroyed.
class ProcessBus final : public Bus {
 public:
  /// True for a message that the process does not get.
  using Loss = std::function<bool(const std::string& channel, Bytes bytes)>;

  ProcessBus(QueueBus& queue, const std::string& name, std::int64_t epoch, Loss loss = {})
      : bus_(queue.AddNode(name)), epoch_(epoch), loss_(std::move(loss)) {}

  void Publish(const std::string& channel, Bytes bytes) override { bus_.Publish(channel, bytes); }
  void PublishPaced(const std::string& channel, Bytes bytes) override {
    bus_.PublishPaced(channel, bytes);
  }
  void Subscribe(const std::string& channel, Handler handler) override {
    bus_.Subscribe(channel, [this, alive = std::weak_ptr<bool>(alive_), channel, handler](
                                Time now, Bytes bytes) {
      if (!alive.expired() && !(loss_ && loss_(channel, bytes))) handler(now, bytes);
    });
  }
  void Every(Duration period, Tick tick) override {
    bus_.Every(period, [alive = std::weak_ptr<bool>(alive_), tick](Time now) {
      if (!alive.expired()) tick(now);
    });
  }
  void WhenCaughtUp(std::function<void()> work) override {
    bus_.WhenCaughtUp([alive = std::weak_ptr<bool>(alive_), work] {
      if (!alive.expired()) work();
    });
  }
  std::int64_t epoch() const override { return epoch_; }

 private:
  Bus& bus_;
  std::int64_t epoch_;
  Loss loss_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>();
};

/// A node on its bus.
template <class Node>
struct Process {
  template <class... Args>
  Process(QueueBus& queue, std::int64_t epoch, const Args&... args)
      : bus(queue, "dut", epoch), node(bus, args...) {}

  ProcessBus bus;
  Node node;
};

/// A bus, and the rest of the world on it: says messages with the headers of one sender a channel,
/// and keeps all that is said.
class Bench {
 public:
  static constexpr std::int64_t kRun = 7;

  Bench() {
    queue.Observe([this](Time, const std::string& channel, Bytes bytes) {
      said_[channel].emplace_back(bytes.begin(), bytes.end());
    });
  }

  /// The next header of this bench on `channel`.
  header_t NextHeader(const std::string& channel, Time time) {
    header_t header{};
    header.utime_us = ToUtime(time);
    header.run_id = kRun;
    header.epoch = epoch;
    header.sequence = sequence_[channel]++;
    header.sender = "bench";
    return header;
  }

  /// Says `message`, which is true at `time`, at that time or, when that has passed, now.
  template <class Message>
  void Say(const Channel<Message>& channel, Message message, Time time) {
    message.header = NextHeader(channel.name, time);
    SayAsIs(channel, message, time);
  }
  template <class Message>
  void SayAsIs(const Channel<Message>& channel, const Message& message, Time time) {
    queue.PublishAt(std::max(time, queue.now()), channel.name, Encode(message));
  }
  /// Says a large message in chunks.
  template <class Message>
  void SayLarge(const Channel<chunk_t>& channel, std::int64_t item, std::int64_t version,
                const Message& message, Time time) {
    if (!speaker_) speaker_ = std::make_unique<ProcessBus>(queue, "bench", epoch);
    if (!endpoint_) endpoint_ = std::make_unique<Endpoint>(*speaker_, "bench", kRun);
    endpoint_->PublishLarge(channel, item, version, message, time);
  }

  void RunUntil(Time time) { queue.RunUntil(time); }
  void RunFor(Duration duration) { queue.RunUntil(queue.now() + duration); }

  /// All messages of a channel since the start or since Forget().
  template <class Message>
  std::vector<Message> Said(const Channel<Message>& channel) const {
    std::vector<Message> messages;
    const auto found = said_.find(channel.name);
    if (found == said_.end()) return messages;
    for (const auto& bytes : found->second) {
      Message message{};
      if (Decode(bytes, message)) messages.push_back(message);
    }
    return messages;
  }
  template <class Message>
  Message Last(const Channel<Message>& channel) const {
    const auto messages = Said(channel);
    EXPECT_FALSE(messages.empty()) << channel.name;
    return messages.empty() ? Message{} : messages.back();
  }
  /// The large messages of a channel, put together from their chunks.
  template <class Message>
  std::vector<Message> SaidLarge(const Channel<chunk_t>& channel) const {
    std::vector<Message> messages;
    ChunkAssembler assembler;
    for (const chunk_t& chunk : Said(channel)) {
      const auto whole = assembler.Add(chunk);
      Message message{};
      if (whole && Decode(whole->bytes, message)) messages.push_back(message);
    }
    return messages;
  }
  const std::map<std::string, std::vector<std::vector<std::uint8_t>>>& said() const {
    return said_;
  }
  void Forget() { said_.clear(); }

  /// The newest STATUS of `process`.
  status_t StatusOf(const std::string& process) const {
    status_t newest{};
    for (const status_t& status : Said(outputs::kStatus))
      if (status.process == process) newest = status;
    return newest;
  }
  std::int64_t CounterOf(const std::string& process, const std::string& counter) const {
    for (const counter_t& c : StatusOf(process).counter)
      if (c.name == counter) return c.value;
    ADD_FAILURE() << process << " does not count " << counter;
    return -1;
  }

  QueueBus queue;
  std::int64_t epoch = 100;

 private:
  std::map<std::string, std::int64_t> sequence_;
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> said_;
  std::unique_ptr<ProcessBus> speaker_;
  std::unique_ptr<Endpoint> endpoint_;
};

/// Says damaged copies of `message`: cut short, too long, of another type by one bit, and pure
/// noise. Returns how many were said.
template <class Message>
int SayDamaged(Bench& bench, const Channel<Message>& channel, Message message, Random& random) {
  message.header = {};
  message.header.run_id = Bench::kRun + 1;
  const std::vector<std::uint8_t> whole = Encode(message);
  constexpr int kCopies = 40;
  for (int i = 0; i < kCopies; ++i) {
    std::vector<std::uint8_t> bytes = whole;
    if (i % 4 == 0)
      bytes.resize(static_cast<std::size_t>(random.Index(static_cast<int>(bytes.size()))));
    if (i % 4 == 1) bytes.push_back(0);
    // In the type's fingerprint.
    if (i % 4 == 2)
      bytes[static_cast<std::size_t>(random.Index(8))] ^=
          static_cast<std::uint8_t>(1 << random.Index(8));
    if (i % 4 == 3)
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.Index(256));
    bench.queue.PublishAt(bench.queue.now(), channel.name, bytes);
  }
  bench.RunFor(Duration(1));
  return kCopies;
}

/// A folder of its own, gone with the test.
class TestFolder {
 public:
  TestFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path = std::filesystem::path(testing::TempDir()) /
           (std::string(test->test_suite_name()) + "." + test->name());
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
  }
  ~TestFolder() { std::filesystem::remove_all(path); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  std::filesystem::path path;
};

/// What a wide fan sees from inside the empty room `room_W`, tilted by `tilt_rad`.
inline Scan ScanOfRoom(const Eigen::AlignedBox3d& room_W, const Pose3& X_WB, double tilt_rad,
                       Time time, std::int64_t sequence) {
  Scan scan{time, sequence, MakePose({0.1, 0, 0}, {0, -tilt_rad, 0}), 0.2, 6, {}};
  const Pose3 X_WS = X_WB * scan.X_BS;
  for (int i = -20; i <= 20; ++i) {
    const double bearing_rad = ToRadians(3.0 * i);
    const Vec3 direction_W = X_WS.linear() * BeamDirection(bearing_rad);
    double range_m = std::numeric_limits<double>::max();
    for (int axis = 0; axis < 3; ++axis) {
      const double side_m = direction_W[axis] > 0 ? room_W.max()[axis] : room_W.min()[axis];
      if (std::abs(direction_W[axis]) > 1e-9)
        range_m = std::min(range_m, (side_m - X_WS.translation()[axis]) / direction_W[axis]);
    }
    const bool has_echo = range_m <= scan.max_range_m;
    scan.beams.push_back({static_cast<float>(bearing_rad),
                          has_echo ? static_cast<float>(range_m) : 0, has_echo ? 0.5f : 0,
                          has_echo ? BeamStatus::kReturn : BeamStatus::kClear});
  }
  return scan;
}

/// A vehicle that circles in a room and tells NAV ten times and SCAN five times a second.
class CirclingVehicle {
 public:
  static constexpr Duration kNavPeriod{100000};

  explicit CirclingVehicle(Bench& bench) : bench_(bench) {}

  const Eigen::AlignedBox3d room_W{Vec3(-3, -2.5, -1.2), Vec3(3, 2.5, 1.3)};

  static Pose3 PoseAt(Time time) {
    const double angle = 0.3 * ToSeconds(time);
    return MakePose({0.8 * std::sin(angle), 0.8 * (1 - std::cos(angle)), 0.1 * std::sin(angle)},
                    {0, 0, WrapAngle(angle)});
  }
  OdometrySample SampleAt(Time time) const {
    OdometrySample sample;
    sample.time = time;
    sample.origin = sample.segment = segment;
    sample.X_OB = PoseAt(time);
    sample.covariance = ToSeconds(time) * Vec3(1e-4, 1e-4, 1e-6).asDiagonal();
    return sample;
  }
  Scan ScanAt(Time time, std::int64_t sequence) const {
    return ScanOfRoom(room_W, PoseAt(time), 0.5 * std::sin(ToSeconds(time)), time, sequence);
  }

  /// Queues what is said from now until `scans` more scans were taken; call bench.RunUntil(end()).
  void Drive(int scans) {
    for (const int until = scans_ + scans; scans_ < until; ++ticks_) {
      const Time time(ticks_ * kNavPeriod);
      SayNav(SampleAt(time));
      if (ticks_ % 2 == 0) continue;
      bench_.Say(outputs::kScan, ToMessage(ScanAt(time, scans_)), time);
      registered.push_back({ScanAt(time, scans_), SampleAt(time)});
      ++scans_;
    }
    bench_.RunUntil(end());
  }
  /// Tells for some milliseconds that it is kilometres away, and a scan from there.
  void LeapFarAway() {
    for (int i = 0; i < 6; ++i) {
      const Time time = end() + Duration(1000 * (i + 1));
      if (i == 3) bench_.Say(outputs::kScan, ToMessage(ScanAt(time, 100)), time);
      OdometrySample sample = SampleAt(time);
      sample.X_OB.translation() = Vec3(2400, -2300, 1500);
      SayNav(sample);
    }
  }
  Time end() const { return Time((ticks_ - 1) * kNavPeriod); }

  std::int64_t segment = 3;
  /// All that was said, as its hearers should understand it.
  std::vector<RegisteredScan> registered;

 private:
  void SayNav(const OdometrySample& sample) {
    nav_t nav = ToMessage(sample);
    nav.header = bench_.NextHeader(outputs::kNav.name, sample.time);
    nav.header.epoch = segment;
    bench_.SayAsIs(outputs::kNav, nav, sample.time);
  }

  Bench& bench_;
  int ticks_ = 0, scans_ = 0;
};

}  // namespace vog
