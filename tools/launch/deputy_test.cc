#include "tools/launch/deputy.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <random>

#include "lib/bus/queue_bus.h"
#include "tools/launch/launch_testing.h"

namespace vog {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(10);

/// A deputy called "me" on a bus whose time goes on 10 ms a step.
class DeputyTest : public ::testing::Test {
 protected:
  DeputyTest() {
    bus_.RunUntil(FromUtime(1'000'000'000));
    procman::Subscribe(sheriff_, procman::kInfo, [this](Time now, const auto& info) {
      info_ = info;
      info_times_.push_back(now);
    });
    procman::Subscribe(sheriff_, procman::kPrintf,
                       [this](Time, const auto& message) { printed_ += message.text; });
    procman::Subscribe(sheriff_, procman::kDiscovery,
                       [this](Time, const auto& message) { discoveries_.push_back(message); });
    deputy_.emplace(bus_.AddNode("deputy"), DeputyOptions{"me", "/nosuch", scratch_.path()});
  }

  void RunFor(Duration duration) { bus_.RunUntil(bus_.now() + duration); }
  bool Until(const std::function<bool()>& is_done) {
    return StepUntil([this](Time) { RunFor(kStep); }, is_done);
  }
  void GetReady() {
    RunFor(std::chrono::milliseconds(1600));
    ASSERT_TRUE(deputy_->IsReady());
  }

  bot_procman::orders2_t OrdersFor(const std::vector<CommandSpec>& specs, int run = 1) {
    bot_procman::orders2_t orders{};
    orders.utime = ToUtime(bus_.now());
    orders.host = "me";
    for (const CommandSpec& spec : specs) {
      bot_procman::sheriff_cmd2_t order{};
      order.cmd = procman::ToMessage(spec);
      order.desired_runid = run;
      order.sheriff_id = static_cast<int>(orders.cmds.size()) + 1;
      orders.cmds.push_back(order);
    }
    orders.ncmds = static_cast<int>(orders.cmds.size());
    return orders;
  }
  void Send(const bot_procman::orders2_t& orders) {
    sheriff_.Publish(procman::kOrders.name, Encode(orders));
    RunFor(kStep);
  }
  int PidOf(std::size_t index) const {
    return index < info_.cmds.size() ? info_.cmds[index].pid : 0;
  }

  QueueBus bus_;
  Bus& sheriff_ = bus_.AddNode("sheriff");
  ScratchFolder scratch_;
  bot_procman::info2_t info_{};
  std::vector<Time> info_times_;
  std::string printed_;
  std::vector<bot_procman::discovery_t> discoveries_;
  std::optional<Deputy> deputy_;
};

TEST_F(DeputyTest, LooksAroundThenTellsHowItIsOnceASecond) {
  RunFor(std::chrono::milliseconds(450));
  EXPECT_FALSE(deputy_->IsReady());
  EXPECT_TRUE(info_times_.empty());
  ASSERT_GE(discoveries_.size(), 2u);
  EXPECT_EQ(discoveries_[0].host, "me");
  EXPECT_EQ(discoveries_[0].nonce, ::getpid());
  RunFor(std::chrono::seconds(5));
  EXPECT_TRUE(deputy_->IsReady());
  EXPECT_FALSE(deputy_->HasRival());
  EXPECT_GE(info_times_.size(), 4u);
  EXPECT_LE(info_times_.size(), 6u);
  EXPECT_EQ(info_.host, "me");
  EXPECT_GT(info_.phys_mem_total_bytes, info_.phys_mem_free_bytes);
}

TEST_F(DeputyTest, RunsWhatIsOrderedAndTellsAtOnce) {
  GetReady();
  Send(OrdersFor({SpecOf("a", "sh -c 'echo hello; sleep 100'"), SpecOf("b", "sleep 100")}));
  RunFor(2 * kStep);
  ASSERT_EQ(info_.cmds.size(), 2u);
  EXPECT_GT(PidOf(0), 0);
  EXPECT_GT(PidOf(1), 0);
  EXPECT_EQ(info_.cmds[0].actual_runid, 1);
  EXPECT_EQ(info_.cmds[1].cmd.command_name, "b");
  EXPECT_EQ(info_.cmds[1].sheriff_id, 2);
  ASSERT_TRUE(Until([this] { return printed_ == "hello\n"; }));
  // A second passes: memory is known.
  RunFor(std::chrono::seconds(1));
  EXPECT_GT(info_.cmds[0].mem_rss_bytes, 0);
  EXPECT_GT(info_.cmds[0].mem_vsize_bytes, info_.cmds[0].mem_rss_bytes);
}

TEST_F(DeputyTest, WhatIsNoLongerOrderedIsStoppedAndForgotten) {
  GetReady();
  Send(OrdersFor({SpecOf("a", "sleep 100"), SpecOf("b", "sleep 100")}));
  ASSERT_TRUE(Until([this] { return PidOf(0) > 0 && PidOf(1) > 0; }));
  const int kept = PidOf(0);
  Send(OrdersFor({SpecOf("a", "sleep 100")}));
  ASSERT_TRUE(Until([this] { return info_.cmds.size() == 1; }));
  EXPECT_EQ(PidOf(0), kept);
  EXPECT_NE(printed_.find("b: killed by Interrupt"), std::string::npos) << printed_;
}

TEST_F(DeputyTest, OldOrdersAndThoseForOthersAreIgnored) {
  GetReady();
  auto orders = OrdersFor({SpecOf("a", "sleep 100")});
  orders.host = "you";
  Send(orders);
  orders.host = "me";
  orders.utime -= 61'000'000;
  Send(orders);
  orders.utime = std::numeric_limits<std::int64_t>::min();
  Send(orders);
  RunFor(std::chrono::seconds(1));
  EXPECT_TRUE(info_.cmds.empty());
  EXPECT_FALSE(deputy_->IsAnyRunning());
}

TEST_F(DeputyTest, NamesThatAreNoFilesAreRefused) {
  GetReady();
  Send(OrdersFor({SpecOf("", "sleep 100"), SpecOf("../a", "sleep 100"), SpecOf("..", "sleep 100"),
                  SpecOf("good", "sleep 100")}));
  ASSERT_TRUE(Until([this] { return PidOf(0) > 0; }));
  ASSERT_EQ(info_.cmds.size(), 1u);
  EXPECT_EQ(info_.cmds[0].cmd.command_name, "good");
}

TEST_F(DeputyTest, ANumberThatMeansAnotherCommandFirstStopsTheOld) {
  GetReady();
  Send(OrdersFor({SpecOf("a", "sleep 100")}));
  ASSERT_TRUE(Until([this] { return PidOf(0) > 0; }));
  const auto orders = OrdersFor({SpecOf("b", "sleep 100")});
  Send(orders);
  ASSERT_TRUE(Until([this] { return !deputy_->IsAnyRunning(); }));
  RunFor(kStep);
  Send(orders);
  ASSERT_TRUE(Until([this] { return PidOf(0) > 0 && info_.cmds[0].cmd.command_name == "b"; }));
}

TEST_F(DeputyTest, TellsWhyItGaveUp) {
  GetReady();
  Send(OrdersFor({SpecOf("a", "vog-no-such-program")}));
  ASSERT_TRUE(Until([this] { return !info_.cmds.empty() && info_.cmds[0].actual_runid == 1; }));
  EXPECT_NE(procman::GivenUp(info_.cmds[0].cmd).find("no such program"), std::string::npos);
  EXPECT_EQ(PidOf(0), 0);
}

TEST_F(DeputyTest, StopsAllAndObeysNoMore) {
  GetReady();
  Send(OrdersFor({SpecOf("a", "sleep 100"), SpecOf("b", "sleep 100")}));
  ASSERT_TRUE(Until([this] { return PidOf(1) > 0; }));
  deputy_->StopAll();
  ASSERT_TRUE(Until([this] { return !deputy_->IsAnyRunning(); }));
  Send(OrdersFor({SpecOf("a", "sleep 100")}, 2));
  RunFor(std::chrono::seconds(1));
  EXPECT_FALSE(deputy_->IsAnyRunning());
}

TEST_F(DeputyTest, FindsARivalThatIsThereOrComesAtTheSameTime) {
  bot_procman::discovery_t theirs{ToUtime(bus_.now()), "you", 1};
  sheriff_.Publish(procman::kDiscovery.name, Encode(theirs));
  RunFor(kStep);
  EXPECT_FALSE(deputy_->HasRival());
  theirs.host = "me";
  theirs.nonce = ::getpid();  // Its own echo.
  sheriff_.Publish(procman::kDiscovery.name, Encode(theirs));
  RunFor(kStep);
  EXPECT_FALSE(deputy_->HasRival());
  theirs.nonce = 1;
  sheriff_.Publish(procman::kDiscovery.name, Encode(theirs));
  RunFor(kStep);
  EXPECT_TRUE(deputy_->HasRival());
}

TEST_F(DeputyTest, AnswersTheDiscoveryOfANewcomer) {
  GetReady();
  const std::size_t told = info_times_.size();
  sheriff_.Publish(procman::kDiscovery.name,
                   Encode(bot_procman::discovery_t{ToUtime(bus_.now()), "me", 1}));
  RunFor(kStep);
  EXPECT_GT(info_times_.size(), told);
  EXPECT_FALSE(deputy_->HasRival());
  // And another one that looks around hears it.
  Deputy second(bus_.AddNode("second"), {"me", "/nosuch", scratch_.path()});
  RunFor(std::chrono::milliseconds(100));
  sheriff_.Publish(procman::kInfo.name, Encode(info_));
  RunFor(kStep);
  EXPECT_TRUE(second.HasRival());
}

TEST_F(DeputyTest, DamagedMessagesDoNoHarm) {
  GetReady();
  std::mt19937 random(3);
  const auto below = [&](std::size_t end) { return random() % end; };
  // `true` is all that damage of this size can start.
  const auto good = Encode(OrdersFor({SpecOf("a", "true"), SpecOf("b", "true")}));
  for (int i = 0; i < 3000; ++i) {
    auto bytes = good;
    for (std::size_t flips = 1 + below(3); flips > 0; --flips)
      bytes[8 + below(bytes.size() - 8)] ^= static_cast<std::uint8_t>(1u << below(8));
    if (i % 4 == 0) bytes.resize(below(bytes.size()));
    sheriff_.Publish(i % 5 == 0 ? procman::kDiscovery.name : procman::kOrders.name, bytes);
    if (i % 100 == 0) RunFor(kStep);
  }
  deputy_->StopAll();
  ASSERT_TRUE(Until([this] { return !deputy_->IsAnyRunning(); }));
  RunFor(std::chrono::seconds(2));
  EXPECT_EQ(info_.host, "me");
}

}  // namespace
}  // namespace vog
