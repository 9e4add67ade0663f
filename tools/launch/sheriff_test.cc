#include "tools/launch/sheriff.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "lib/bus/queue_bus.h"
#include "tools/launch/launch_testing.h"

namespace vog {
namespace {

/// A sheriff, and a deputy that obeys at once without starting anything.
class SheriffTest : public ::testing::Test {
 protected:
  SheriffTest() {
    bus_.RunUntil(FromUtime(1'000'000'000));
    procman::Subscribe(deputy_, procman::kOrders, [this](Time, const auto& orders) {
      ++orders_heard_;
      orders_[orders.host] = orders;
    });
  }

  void Make(const std::string& text) {
    told_.clear();
    sheriff_.emplace(bus_.AddNode("sheriff"), ParsePmd(text, "t.pmd"), "me");
  }
  void Run(const std::string& script, const std::string& text) {
    Make(text);
    sheriff_->Run(*ParsePmd(text, "t.pmd").FindScript(script));
    Tick();
  }
  void Tick(int count = 3) { bus_.RunUntil(bus_.now() + count * std::chrono::milliseconds(10)); }

  const bot_procman::sheriff_cmd2_t& OrderOf(const std::string& name) {
    for (const auto& [host, orders] : orders_)
      for (const auto& order : orders.cmds)
        if (order.cmd.command_name == name) return order;
    ADD_FAILURE() << name << " is not ordered";
    std::abort();
  }
  bool IsOrdered(const std::string& name) {
    const auto& order = OrderOf(name);
    return order.desired_runid > 0 && !order.force_quit;
  }
  /// Says of a command that it has that pid, 0 that it has ended.
  void Tell(const std::string& name, int pid, const std::string& given_up = "") {
    bot_procman::deputy_cmd2_t& told = told_[name];
    told.cmd = OrderOf(name).cmd;
    told.sheriff_id = OrderOf(name).sheriff_id;
    told.actual_runid = OrderOf(name).desired_runid;
    told.pid = pid;
    told.exit_code = 3 << 8;
    if (!given_up.empty()) procman::SetGivenUp(told.cmd, given_up);
    bot_procman::info2_t info{};
    info.host = "me";
    for (const auto& [other, command] : told_) info.cmds.push_back(command);
    info.ncmds = static_cast<int>(info.cmds.size());
    deputy_.Publish(procman::kInfo.name, Encode(info));
    Tick();
  }
  void TellStatus(const std::string& process) {
    status_t status{};
    status.process = process;
    deputy_.Publish(outputs::kStatus.name, Encode(status));
    Tick();
  }

  QueueBus bus_;
  Bus& deputy_ = bus_.AddNode("deputy");
  std::map<std::string, bot_procman::orders2_t> orders_;
  std::map<std::string, bot_procman::deputy_cmd2_t> told_;
  int orders_heard_ = 0;
  std::optional<Sheriff> sheriff_;
};

constexpr const char* kTwo = R"(
cmd "a" { exec = "x"; }
group "g" { cmd "b" { exec = "A=1 /some/where/vog-slam --config vog-x.toml"; auto_respawn = "true"; } }
script "both" { start cmd "a" wait "running"; start group "g" wait "running"; }
script "again" { run_script "both"; restart cmd "a"; wait ms 500; stop everything wait "stopped"; }
)";

TEST_F(SheriffTest, OrdersOnceASecondAndEachHostItsOwn) {
  Make("cmd \"a\" { exec = \"x\"; } cmd \"b\" { exec = \"y\"; host = \"other\"; }");
  Tick(500);
  EXPECT_GE(orders_heard_, 2 * 5);
  EXPECT_LE(orders_heard_, 2 * 6);
  ASSERT_EQ(orders_.size(), 2u);
  EXPECT_EQ(orders_["me"].cmds.at(0).cmd.command_name, "a");
  EXPECT_EQ(orders_["me"].cmds.at(0).desired_runid, 0);
  EXPECT_EQ(orders_["other"].cmds.at(0).cmd.command_name, "b");
}

TEST_F(SheriffTest, WaitsForEachStepOfAScript) {
  Run("both", kTwo);
  EXPECT_TRUE(IsOrdered("a"));
  EXPECT_FALSE(IsOrdered("b"));
  EXPECT_EQ(sheriff_->waits_for(), "\"a\" (a) to be ready");
  Tell("a", 11);  // Others' programs are ready when they run.
  EXPECT_TRUE(IsOrdered("b"));
  Tell("b", 12);
  EXPECT_FALSE(sheriff_->IsIdle());  // Ours when they say so.
  TellStatus("vog-planner");
  EXPECT_FALSE(sheriff_->IsIdle());
  TellStatus("vog-slam");
  EXPECT_TRUE(sheriff_->IsIdle());
  EXPECT_EQ(sheriff_->waits_for(), "nothing");
  EXPECT_TRUE(sheriff_->IsEverything(AwaitedStatus::kRunning));
  const std::vector<std::string> news = sheriff_->TakeNews();
  EXPECT_EQ(news,
            (std::vector<std::string>{"a: started, pid 11", "b: started, pid 12", "b: ready"}));
}

TEST_F(SheriffTest, ScriptsRunScriptsRestartWaitAndStop) {
  Run("again", kTwo);
  Tell("a", 11);
  Tell("b", 12);
  TellStatus("vog-slam");
  EXPECT_EQ(OrderOf("a").desired_runid, 2);  // Restarted.
  EXPECT_FALSE(OrderOf("a").force_quit);
  EXPECT_EQ(sheriff_->waits_for(), "time to pass");
  Tell("a", 13);
  Tick(55);
  EXPECT_TRUE(OrderOf("a").force_quit);
  EXPECT_TRUE(OrderOf("b").force_quit);
  Tell("a", 0);
  EXPECT_EQ(sheriff_->waits_for(), "everything (b) to be stopped");
  Tell("b", 0);
  EXPECT_TRUE(sheriff_->IsIdle());
}

TEST_F(SheriffTest, AStartTwiceOrdersOneRun) {
  Run("s",
      "cmd \"a\" { exec = \"x\"; } script \"s\" { start cmd \"a\"; wait ms 50; start everything; "
      "}");
  Tick(10);
  EXPECT_TRUE(sheriff_->IsIdle());
  EXPECT_EQ(OrderOf("a").desired_runid, 1);
}

TEST_F(SheriffTest, WhatIsOnlyOrderedIsNotStopped) {
  Run("s", "cmd \"a\" { exec = \"x\"; } script \"s\" { start cmd \"a\" wait \"stopped\"; }");
  EXPECT_FALSE(sheriff_->IsIdle());
  Tell("a", 11);
  EXPECT_FALSE(sheriff_->IsIdle());
  Tell("a", 0);
  EXPECT_TRUE(sheriff_->IsIdle());
}

TEST_F(SheriffTest, StopsInTheOppositeOrder) {
  Run("both", kTwo);
  Tell("a", 11);
  Tell("b", 12);
  TellStatus("vog-slam");
  sheriff_->StopInOrder();
  Tick();
  EXPECT_TRUE(OrderOf("b").force_quit);
  EXPECT_FALSE(OrderOf("a").force_quit);
  Tell("b", 0);
  EXPECT_TRUE(OrderOf("a").force_quit);
  Tell("a", 0);
  EXPECT_TRUE(sheriff_->IsIdle());
  EXPECT_TRUE(sheriff_->IsEverything(AwaitedStatus::kStopped));
}

TEST_F(SheriffTest, KnowsWhenWaitingIsInVain) {
  Run("both", kTwo);
  EXPECT_EQ(sheriff_->hopeless(), "");
  Tell("a", 11);
  Tell("b", 12);
  Tell("b", 0);  // Its deputy starts it again.
  EXPECT_EQ(sheriff_->hopeless(), "");
  Tell("b", 0, "why");
  EXPECT_EQ(sheriff_->hopeless(), "b: given up: why");
  EXPECT_EQ(sheriff_->TakeNews().back(), "b: given up: why");
  Run("both", kTwo);
  Tell("a", 11);
  Tell("a", 0);
  EXPECT_EQ(sheriff_->hopeless(), "");  // It had been ready; b is awaited now.
}

TEST_F(SheriffTest, WhatItsDeputyForgetsIsStopped) {
  Run("s", "cmd \"a\" { exec = \"x\"; } script \"s\" { start cmd \"a\" wait \"running\"; }");
  Tell("a", 11);
  bot_procman::info2_t info{};
  info.host = "me";
  deputy_.Publish(procman::kInfo.name, Encode(info));
  Tick();
  EXPECT_EQ(OrderOf("a").desired_runid, 1);  // It may start it anew.
  sheriff_->StopInOrder();
  Tick();
  EXPECT_TRUE(sheriff_->IsIdle());
}

TEST_F(SheriffTest, ACommandThatEndsBeforeItIsReadyIsHopeless) {
  Run("s", "cmd \"a\" { exec = \"vog-x\"; } script \"s\" { start cmd \"a\" wait \"running\"; }");
  Tell("a", 11);
  Tell("a", 0);
  EXPECT_EQ(sheriff_->hopeless(), "a: exit status 3");
}

}  // namespace
}  // namespace vog
