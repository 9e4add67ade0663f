#include "lib/bus/queue_bus.h"

#include <gtest/gtest.h>

#include <sstream>

#include "lib/base/random.h"

namespace vog {
namespace {

using std::chrono::milliseconds;

Time At(int ms) { return Time(milliseconds(ms)); }

std::vector<std::uint8_t> Word(const std::string& text) { return {text.begin(), text.end()}; }

class QueueBusTest : public testing::Test {
 protected:
  /// A handler that writes down what it hears, as "12:text ".
  Bus::Handler Note() {
    return [this](Time now, Bytes bytes) {
      heard_ +=
          std::to_string(ToUtime(now) / 1000) + ":" + std::string(bytes.begin(), bytes.end()) + " ";
    };
  }

  QueueBus dut_;
  std::string heard_;
};

TEST_F(QueueBusTest, MessagesComeInOrderOfTimeThenOfArrival) {
  dut_.AddNode("a").Subscribe("X", Note());
  dut_.PublishAt(At(30), "X", Word("d"));
  dut_.PublishAt(At(10), "X", Word("a"));
  dut_.PublishAt(At(20), "X", Word("b"));
  dut_.PublishAt(At(20), "X", Word("c"));
  dut_.PublishAt(At(10), "Y", Word("not for us"));
  dut_.RunUntil(At(100));
  EXPECT_EQ(heard_, "10:a 20:b 20:c 30:d ");
}

TEST_F(QueueBusTest, RunsUpToAndIncludingTheEnd) {
  dut_.AddNode("a").Subscribe("X", Note());
  dut_.PublishAt(At(10), "X", Word("a"));
  dut_.PublishAt(At(11), "X", Word("b"));
  dut_.RunUntil(At(10));
  EXPECT_EQ(heard_, "10:a ");
  EXPECT_EQ(dut_.now(), At(10));
  dut_.RunUntil(At(50));
  EXPECT_EQ(heard_, "10:a 11:b ");
  EXPECT_EQ(dut_.now(), At(50));
}

TEST_F(QueueBusTest, WhatANodePublishesArrivesItsLatencyLater) {
  Bus& slow = dut_.AddNode("slow", milliseconds(5));
  Bus& quick = dut_.AddNode("quick");
  slow.Subscribe("IN", [&](Time, Bytes bytes) { slow.Publish("OUT", bytes); });
  quick.Subscribe("IN", [&](Time, Bytes) { quick.PublishPaced("OUT", Word("quick")); });
  quick.Subscribe("OUT", Note());
  dut_.PublishAt(At(10), "IN", Word("slow"));
  dut_.RunUntil(At(100));
  EXPECT_EQ(heard_, "10:quick 15:slow ");
}

TEST_F(QueueBusTest, ANodeWorksAfterEachOfItsMessages) {
  Bus& a = dut_.AddNode("a");
  a.Subscribe("X", Note());
  a.WhenCaughtUp([this] { heard_ += "work "; });
  for (const char* channel : {"X", "Y", "X"}) dut_.PublishAt(At(10), channel, Word("x"));
  dut_.RunUntil(At(20));
  EXPECT_EQ(heard_, "10:x work 10:x work ");
}

TEST_F(QueueBusTest, EachSubscriberHearsEachMessageInOrderOfSubscription) {
  Bus& a = dut_.AddNode("a");
  Bus& b = dut_.AddNode("b");
  b.Subscribe("X", [this](Time, Bytes) { heard_ += "b "; });
  a.Subscribe("X", [this](Time, Bytes) { heard_ += "a "; });
  a.Publish("X", Word(""));  // Who publishes hears itself, too.
  dut_.RunUntil(At(0));
  EXPECT_EQ(heard_, "b a ");
}

TEST_F(QueueBusTest, TicksComeEveryPeriod) {
  Bus& node = dut_.AddNode("a");
  node.Every(milliseconds(10), [this](Time now) {
    EXPECT_EQ(now, dut_.now());
    heard_ += "t" + std::to_string(ToUtime(now) / 1000) + " ";
  });
  dut_.RunUntil(At(25));
  dut_.RunUntil(At(40));
  EXPECT_EQ(heard_, "t10 t20 t30 t40 ");
  EXPECT_EQ(node.epoch(), 0);
}

TEST_F(QueueBusTest, ObserversSeeEachMessageBeforeItsHandlers) {
  dut_.AddNode("a").Subscribe("X", Note());
  dut_.Observe([this](Time now, const std::string& channel, Bytes) {
    heard_ += channel + "@" + std::to_string(ToUtime(now) / 1000) + " ";
  });
  dut_.PublishAt(At(1), "X", Word("a"));
  dut_.PublishAt(At(2), "UNHEARD", Word("b"));
  dut_.RunUntil(At(5));
  EXPECT_EQ(heard_, "X@1 1:a UNHEARD@2 ");
}

TEST_F(QueueBusTest, TellsWhatEachHandlerDid) {
  Bus& a = dut_.AddNode("a", milliseconds(1));
  Bus& b = dut_.AddNode("b");
  a.Subscribe("IN", [&](Time, Bytes) {
    a.Publish("P", Word(""));
    a.Publish("Q", Word(""));
  });
  b.Subscribe("IN", Note());
  b.Subscribe("P", Note());
  std::vector<QueueBus::Handled> all;
  dut_.ObserveHandled([&](const QueueBus::Handled& handled) { all.push_back(handled); });
  dut_.PublishAt(At(10), "IN", Word("x"));
  dut_.RunUntil(At(20));
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].node, "a");
  EXPECT_EQ(all[0].channel, "IN");
  EXPECT_EQ(all[0].time, At(10));
  EXPECT_EQ(all[0].published, (std::vector<std::string>{"P", "Q"}));
  EXPECT_EQ(all[1].node, "b");
  EXPECT_TRUE(all[1].published.empty());
  EXPECT_EQ(all[2].channel, "P");
  EXPECT_EQ(all[2].time, At(11));
  for (const auto& handled : all) EXPECT_GE(handled.wall_s, 0);
}

TEST_F(QueueBusTest, WhatAHandlerThrowsComesOut) {
  dut_.AddNode("a").Subscribe("X", [](Time, Bytes) { throw std::runtime_error("no"); });
  dut_.PublishAt(At(1), "X", Word(""));
  EXPECT_THROW(dut_.RunUntil(At(5)), std::runtime_error);
}

/// All that happens among nodes that answer at random, as text.
std::string TraceOf(std::uint64_t seed, std::vector<int> stops_ms) {
  QueueBus bus;
  std::ostringstream trace;
  bus.Observe([&](Time now, const std::string& channel, Bytes bytes) {
    trace << ToUtime(now) << channel << std::string(bytes.begin(), bytes.end()) << " ";
  });
  std::vector<Random> randoms;
  for (int i = 0; i < 5; ++i) randoms.emplace_back(seed, "node" + std::to_string(i));
  for (int i = 0; i < 5; ++i) {
    Bus& node = bus.AddNode("node" + std::to_string(i), milliseconds(i % 3));
    Random& random = randoms[i];
    for (const char* channel : {"A", "B"}) {
      node.Subscribe(channel, [&node, &random, i](Time, Bytes) {
        if (random.Chance(0.15))
          node.Publish(random.Chance(0.5) ? "A" : "B", Word(std::to_string(i)));
      });
    }
    node.Every(milliseconds(3 + i),
               [&node, i](Time) { node.Publish("A", Word(std::to_string(i))); });
  }
  for (const int stop_ms : stops_ms) bus.RunUntil(At(stop_ms));
  return trace.str();
}

TEST(QueueBusStartTest, TimeAndEpochBeginAtTheStart) {
  QueueBus queue(Time(std::chrono::seconds(100)));
  Bus& node = queue.AddNode("node");
  std::vector<Time> ticks;
  node.Every(std::chrono::seconds(1), [&](Time now) { ticks.push_back(now); });
  EXPECT_EQ(queue.now(), Time(std::chrono::seconds(100)));
  EXPECT_EQ(node.epoch(), 100'000'000);
  queue.RunUntil(Time(std::chrono::seconds(101)));
  EXPECT_EQ(ticks, std::vector<Time>{Time(std::chrono::seconds(101))});
}

TEST(QueueBusDeterminismTest, ARunIsAFunctionOfItsInputsAlone) {
  const std::string trace = TraceOf(1, {200});
  EXPECT_GT(trace.size(), 1000u);
  EXPECT_EQ(TraceOf(1, {200}), trace);
  EXPECT_EQ(TraceOf(1, {1, 17, 30, 111, 200}), trace);  // Stops on the way change nothing.
  EXPECT_NE(TraceOf(2, {200}), trace);
}

}  // namespace
}  // namespace vog
