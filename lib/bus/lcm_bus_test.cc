#include "lib/bus/lcm_bus.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <memory>
#include <thread>

#include "lib/bus/process.h"
#include "vog/nav_t.hpp"
#include "vog/submap_poses_t.hpp"

// The one test program that opens the network: UDP multicast that does not leave the machine.

namespace vog {
namespace {

using std::chrono::milliseconds;

// Not the port of a mission that may be running here.
constexpr const char* kUrl = "udpm://239.255.76.67:7697?ttl=0";

BusOptions Options(const std::string& suffix = "") {
  BusOptions options;
  options.url = kUrl;
  // Of this process, so that two test runs at a time do not hear each other.
  options.channel_prefix = "T" + std::to_string(::getpid()) + suffix + "_";
  return options;
}

template <class Message>
std::vector<std::uint8_t> Encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Message>
std::vector<std::uint8_t> EncodedAt(std::int64_t utime_us) {
  Message message{};
  message.header.utime_us = utime_us;
  message.header.sender = "test";
  return Encoded(message);
}

/// Lets `bus` work until `done`, but not forever.
template <class Done>
bool RunUntil(LcmBus& bus, Done done) {
  for (int i = 0; i < 1000 && !done(); ++i) bus.RunFor(milliseconds(10));
  return done();
}

class LcmBusTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      here_ = std::make_unique<LcmBus>(Options());
      there_ = std::make_unique<LcmBus>(Options());
    } catch (const SystemError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<LcmBus> here_, there_;
};

TEST_F(LcmBusTest, MessagesOfAllSizesArriveInOrder) {
  std::vector<std::vector<std::uint8_t>> heard;
  there_->Subscribe("X",
                    [&](Time, Bytes bytes) { heard.emplace_back(bytes.begin(), bytes.end()); });
  std::vector<std::vector<std::uint8_t>> said;
  for (const int size : {0, 1, 1000, 60000, 250000}) {
    said.emplace_back(size, static_cast<std::uint8_t>(size));
    here_->Publish("X", said.back());
    ASSERT_TRUE(RunUntil(*there_, [&] { return heard.size() == said.size(); })) << size;
  }
  EXPECT_TRUE(heard == said);
}

TEST_F(LcmBusTest, PacedMessagesAllArriveInOrder) {
  std::vector<std::uint8_t> heard;
  there_->Subscribe("X", [&](Time, Bytes bytes) {
    EXPECT_EQ(bytes.size(), 32000u);
    heard.push_back(bytes[0]);
  });
  for (int i = 0; i < 50; ++i)
    here_->PublishPaced("X", std::vector<std::uint8_t>(32000, static_cast<std::uint8_t>(i)));
  for (int i = 0; i < 1000 && heard.size() < 50; ++i) {
    here_->RunFor(milliseconds(2));
    there_->RunFor(milliseconds(1));
  }
  ASSERT_EQ(heard.size(), 50u);
  EXPECT_TRUE(std::is_sorted(heard.begin(), heard.end()));
}

TEST_F(LcmBusTest, WorksWhenNoMoreMessagesWait) {
  constexpr int kMessages = 50;
  int heard = 0;
  std::vector<int> worked_at;
  there_->Subscribe("X", [&](Time, Bytes) { ++heard; });
  there_->WhenCaughtUp([&] { worked_at.push_back(heard); });
  for (int i = 0; i < kMessages; ++i) here_->Publish("X", {});
  std::this_thread::sleep_for(milliseconds(200));  // Until all are there.
  EXPECT_TRUE(RunUntil(*there_, [&] { return !worked_at.empty(); }));
  EXPECT_EQ(worked_at, std::vector<int>{kMessages});
  there_->RunFor(milliseconds(50));
  EXPECT_EQ(worked_at.size(), 1u) << "nothing came";
  here_->Publish("X", {});
  EXPECT_TRUE(RunUntil(*there_, [&] { return worked_at.size() == 2; }));
  EXPECT_EQ(worked_at.back(), kMessages + 1);
}

TEST_F(LcmBusTest, WorksNowAndThenWhereMessagesNeverCease) {
  int heard = 0, worked = 0;
  there_->Subscribe("X", [&](Time, Bytes bytes) {
    ++heard;
    there_->Publish("X", bytes);
    there_->Publish("X", bytes);
  });
  there_->WhenCaughtUp([&] { ++worked; });
  here_->Publish("X", {});
  EXPECT_TRUE(RunUntil(*there_, [&] { return worked > 0; }));
}

TEST_F(LcmBusTest, FlushSendsAllThatWaits) {
  int heard = 0;
  there_->Subscribe("X", [&](Time, Bytes) { ++heard; });
  for (int i = 0; i < 20; ++i) here_->PublishPaced("X", std::vector<std::uint8_t>(1000));
  here_->Flush();
  EXPECT_TRUE(RunUntil(*there_, [&] { return heard == 20; })) << heard;
}

TEST_F(LcmBusTest, PrefixesKeepSystemsApart) {
  LcmBus other(Options("B"));
  std::vector<std::string> here, elsewhere;
  there_->SubscribeAll([&](Time, const std::string& channel, Bytes) { here.push_back(channel); });
  other.SubscribeAll(
      [&](Time, const std::string& channel, Bytes) { elsewhere.push_back(channel); });
  here_->Publish("NAV", {});
  other.Publish("SCAN", {});
  here_->Publish("POSE", {});
  EXPECT_TRUE(RunUntil(*there_, [&] { return here.size() == 2; }));
  EXPECT_TRUE(RunUntil(other, [&] { return elsewhere.size() == 1; }));
  EXPECT_EQ(here, (std::vector<std::string>{"NAV", "POSE"}));
  EXPECT_EQ(elsewhere, (std::vector<std::string>{"SCAN"}));
}

TEST_F(LcmBusTest, TheMessageClockIsTheNewestTimeTold) {
  BusOptions options = Options();
  options.clock = ClockSource::kMessage;
  LcmBus dut(options);
  std::vector<std::int64_t> times_us;
  dut.Subscribe("X", [&](Time now, Bytes) { times_us.push_back(ToUtime(now)); });
  std::vector<std::int64_t> ticks_us;
  dut.Every(milliseconds(1), [&](Time now) { ticks_us.push_back(ToUtime(now)); });
  EXPECT_TRUE(RunUntil(dut, [&] { return !ticks_us.empty(); }));
  EXPECT_EQ(ticks_us.front(), 0);  // Nobody has told a time yet.
  here_->Publish("X", EncodedAt<nav_t>(5'000'000));
  here_->Publish("X", EncodedAt<submap_poses_t>(7'000'000));
  here_->Publish("X", EncodedAt<nav_t>(6'000'000));
  here_->Publish("X", std::vector<std::uint8_t>{1, 2, 3});
  EXPECT_TRUE(RunUntil(dut, [&] { return times_us.size() == 4; }));
  EXPECT_EQ(times_us, (std::vector<std::int64_t>{5'000'000, 7'000'000, 7'000'000, 7'000'000}));
  ticks_us.clear();
  EXPECT_TRUE(RunUntil(dut, [&] { return !ticks_us.empty(); }));
  EXPECT_EQ(ticks_us.back(), 7'000'000);
}

TEST_F(LcmBusTest, TheMessageClockLeapsOnlyWhenItIsToldTwice) {
  BusOptions options = Options();
  options.clock = ClockSource::kMessage;
  LcmBus dut(options);
  std::vector<double> times_s;
  dut.Subscribe("X", [&](Time now, Bytes) { times_s.push_back(ToSeconds(now)); });
  const std::vector<double> told_s = {5, 3600, 6, -100, 7, 7200, 7201, 1e9, 1e9 + 1};
  for (const double told : told_s)
    here_->Publish("X", EncodedAt<nav_t>(ToUtime(Time(FromSeconds(told)))));
  EXPECT_TRUE(RunUntil(dut, [&] { return times_s.size() == told_s.size(); }));
  EXPECT_EQ(times_s, (std::vector<double>{5, 5, 6, 6, 7, 7, 7201, 7201, 1e9 + 1}));
}

TEST_F(LcmBusTest, TheSystemClockOnlyGrows) {
  std::vector<Time> times;
  here_->Every(milliseconds(1), [&](Time now) { times.push_back(now); });
  EXPECT_TRUE(RunUntil(*here_, [&] { return times.size() >= 5; }));
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_GT(ToUtime(times[0]), 1'600'000'000'000'000);  // Anchored to UTC.
}

TEST_F(LcmBusTest, EpochsGrowFromOneStartToTheNext) { EXPECT_GT(there_->epoch(), here_->epoch()); }

TEST_F(LcmBusTest, WhatAHandlerThrowsComesOutAndTheBusGoesOn) {
  int heard = 0;
  there_->Subscribe("X", [&](Time, Bytes) {
    if (++heard == 1) throw std::runtime_error("no");
  });
  here_->Publish("X", {});
  EXPECT_THROW(RunUntil(*there_, [&] { return heard > 1; }), std::runtime_error);
  here_->Publish("X", {});
  EXPECT_TRUE(RunUntil(*there_, [&] { return heard > 1; }));
}

TEST_F(LcmBusTest, AUrlThatLcmCannotOpenIsTold) {
  BusOptions options;
  options.url = "nonsense://here";
  EXPECT_THROW(LcmBus{options}, SystemError);
}

/// Runs a process as main() would, and keeps what it says.
class ProcessTest : public LcmBusTest {
 protected:
  int Call(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "vog-test");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    return RunProcess({"vog-test", "Tests a process."}, static_cast<int>(argv.size()), argv.data(),
                      [this](LcmBus& bus, const Config& config) {
                        return start_ ? start_(bus, config) : nullptr;
                      });
  }

  int Run(std::vector<std::string> arguments) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    const int status = Call(std::move(arguments));
    out_ = testing::internal::GetCapturedStdout();
    error_ = testing::internal::GetCapturedStderr();
    return status;
  }

  std::string Write(const std::string& text) const {
    const std::string path = testing::TempDir() + "process_test_" + std::to_string(::getpid());
    std::ofstream(path) << "bus.url = \"" << kUrl << "\"\n" << text;
    return path;
  }

  /// One line that names `what`, and status 2.
  void ExpectMisuse(const std::vector<std::string>& arguments, const std::string& what) {
    EXPECT_EQ(Run(arguments), 2);
    EXPECT_NE(error_.find(what), std::string::npos) << error_;
    EXPECT_EQ(error_.find('\n'), error_.size() - 1) << error_;
  }

  std::function<std::shared_ptr<void>(LcmBus&, const Config&)> start_;
  std::string out_, error_;
};

TEST_F(ProcessTest, MisuseIsToldInOneLine) {
  start_ = [](LcmBus&, const Config&) -> std::shared_ptr<void> {
    ADD_FAILURE() << "started";
    throw UsageError("started");
  };
  const std::string good = Write("");
  ExpectMisuse({}, "--config");
  ExpectMisuse({"--config"}, "--config");
  ExpectMisuse({"--config", good, "--speed", "3"}, "--speed");
  ExpectMisuse({"--config", "/nowhere/a.toml"}, "/nowhere/a.toml: no such configuration file");
  ExpectMisuse({"--config", good, "--set", "nonsense"}, "--set nonsense");
  ExpectMisuse({"--config", good, "--set", "bus.clock=sundial"}, "bus.clock must be one of");
  ExpectMisuse({"--config", Write("bus.speed = 1\n")}, ":2: unknown key bus.speed");
  ExpectMisuse({"--config", Write("[buss]\nurl = \"x\"\n")}, ":2: unknown table [buss]");
}

TEST_F(ProcessTest, HelpIsNoMisuse) {
  EXPECT_EQ(Run({"--help"}), 0);
  EXPECT_NE(out_.find("Tests a process."), std::string::npos) << out_;
  EXPECT_NE(out_.find("--config"), std::string::npos) << out_;
}

TEST_F(ProcessTest, FailuresOfTheNodeGiveTheirStatus) {
  start_ = [](LcmBus&, const Config&) -> std::shared_ptr<void> { throw UsageError("bad option"); };
  EXPECT_EQ(Run({"--config", Write("")}), 2);
  EXPECT_TRUE(error_.ends_with(": bad option\n")) << error_;
  start_ = [](LcmBus&, const Config&) -> std::shared_ptr<void> { throw SystemError("disk full"); };
  EXPECT_EQ(Run({"--config", Write("")}), 1);
  EXPECT_TRUE(error_.ends_with(": disk full\n")) << error_;
}

TEST_F(ProcessTest, RunsItsNodeUntilASignalAndSendsWhatStillWaits) {
  int heard = 0, ticks = 0;
  std::weak_ptr<void> node;
  start_ = [&](LcmBus& bus, const Config& config) {
    EXPECT_EQ(config.Read<BusOptions>("bus").channel_prefix, Options().channel_prefix);
    bus.Every(milliseconds(1), [&](Time) {
      if (++ticks == 3) {
        for (int i = 0; i < 5; ++i) bus.PublishPaced("X", {});
        std::raise(SIGTERM);
      }
    });
    auto made = std::make_shared<int>();
    node = made;
    return made;
  };
  there_->Subscribe("X", [&](Time, Bytes) { ++heard; });
  EXPECT_EQ(Run({"--config", Write(""), "--set", "bus.channel_prefix=" + Options().channel_prefix}),
            0);
  EXPECT_GE(ticks, 3);
  EXPECT_TRUE(node.expired());
  EXPECT_TRUE(RunUntil(*there_, [&] { return heard == 5; }));
  EXPECT_EQ(error_, "");
}

// After the others: a signal is remembered.
TEST_F(ProcessTest, ASecondOneOnTheSameBusDoesNotStart) {
  const std::string file = Write("");
  const auto on = [&](const std::string& prefix) {
    return std::vector<std::string>{"--config", file, "--set", "bus.channel_prefix=" + prefix};
  };
  int started = 0;
  start_ = [&](LcmBus& bus, const Config&) -> std::shared_ptr<void> {
    bus.Every(milliseconds(1), [](Time) { std::raise(SIGTERM); });
    if (++started > 1) return nullptr;
    EXPECT_EQ(Call(on("a")), 1);
    EXPECT_EQ(Call(on("b")), 0);
    return nullptr;
  };
  EXPECT_EQ(Run(on("a")), 0) << error_;
  EXPECT_NE(error_.find("one runs already"), std::string::npos) << error_;
  EXPECT_EQ(started, 2);
  EXPECT_EQ(Run(on("a")), 0) << "the first one has ended: " << error_;
}

}  // namespace
}  // namespace vog
