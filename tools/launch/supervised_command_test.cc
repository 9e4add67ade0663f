#include "tools/launch/supervised_command.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include "lib/base/files.h"
#include "tools/launch/launch_testing.h"

namespace vog {
namespace {

class SupervisedCommandTest : public ::testing::Test {
 protected:
  void Make(const std::string& exec, bool auto_respawn = false) {
    spec_ = SpecOf("it", exec, auto_respawn);
    command_.emplace(spec_, "/nosuch", scratch_.path());
  }
  void Order(int run, bool force_quit = false) { command_->Order(spec_, run, force_quit); }
  bool Until(const std::function<bool()>& is_done) {
    return StepUntil([this](Time now) { said_ += command_->Step(now); }, is_done);
  }
  bool UntilRunning() {
    return Until([this] { return command_->IsRunning(); });
  }
  bool UntilEnded() {
    return Until([this] { return !command_->IsRunning(); });
  }
  bool UntilSaid(const std::string& text) {
    return Until([&] { return said_.find(text) != std::string::npos; });
  }

  ScratchFolder scratch_;
  CommandSpec spec_;
  std::optional<SupervisedCommand> command_;
  std::string said_;
};

TEST_F(SupervisedCommandTest, RunsWhenOrderedAndKeepsItsOutput) {
  Make("A=7 sh -c 'echo $A; read x; echo end >&2; exit 3'");
  EXPECT_EQ(command_->Step({}), "");
  EXPECT_FALSE(command_->IsRunning());
  Order(1);
  ASSERT_TRUE(UntilSaid("it: exit status 3\n"));  // read: it has no input to wait for.
  EXPECT_EQ(said_, "7\nend\nit: exit status 3\n");
  EXPECT_EQ(WEXITSTATUS(command_->exit_status()), 3);
  EXPECT_EQ(command_->pid(), 0);
  EXPECT_EQ(ReadFile(scratch_.path() / "it.txt"), "7\nend\n");
}

TEST_F(SupervisedCommandTest, StopsWithItsSignal) {
  Make("sh -c 'trap \"echo caught; exit 0\" TERM; echo ready; while :; do sleep 0.01; done'");
  spec_.stop_signal = SIGTERM;
  Order(1);
  ASSERT_TRUE(UntilSaid("ready"));
  Order(1, true);
  ASSERT_TRUE(UntilEnded());
  EXPECT_NE(said_.find("caught\nit: exit status 0\n"), std::string::npos) << said_;
}

TEST_F(SupervisedCommandTest, IsKilledWhenItDoesNotStop) {
  Make("sh -c 'trap \"\" INT; echo ready; while :; do sleep 0.01; done'");
  spec_.stop_time_allowed_s = 0.3;
  Order(1);
  ASSERT_TRUE(UntilSaid("ready"));
  Order(1, true);
  const Stopwatch waited;
  ASSERT_TRUE(UntilEnded());
  EXPECT_GT(waited.seconds(), 0.25);
  EXPECT_EQ(WTERMSIG(command_->exit_status()), SIGKILL);
}

TEST_F(SupervisedCommandTest, AnOrderTwiceStartsOnce) {
  Make("sleep 100");
  Order(1);
  ASSERT_TRUE(UntilRunning());
  const int pid = command_->pid();
  Order(1);
  command_->Step({});
  EXPECT_EQ(command_->pid(), pid);
  Order(0);  // Of a sheriff that has just come.
  command_->Step({});
  EXPECT_EQ(command_->pid(), pid);
  ::kill(pid, SIGKILL);
  ASSERT_TRUE(UntilEnded());
  Order(1);
  EXPECT_FALSE(StepUntil([this](Time now) { command_->Step(now); },
                         [this] { return command_->IsRunning(); }, 0.1));
  EXPECT_EQ(command_->actual_run(), 1);
}

TEST_F(SupervisedCommandTest, ANewRunReplacesTheOldOne) {
  Make("sleep 100");
  Order(1);
  ASSERT_TRUE(UntilRunning());
  const int pid = command_->pid();
  spec_.exec = "sleep 101";
  Order(1);  // Another exec: from the next start on.
  command_->Step({});
  EXPECT_EQ(command_->pid(), pid);
  Order(2);
  ASSERT_TRUE(Until([&] { return command_->IsRunning() && command_->pid() != pid; }));
  EXPECT_EQ(command_->actual_run(), 2);
  // execve() is on its way.
  const std::string file = "/proc/" + std::to_string(command_->pid()) + "/cmdline";
  EXPECT_TRUE(Until([&] { return ReadFile(file) == std::string("sleep\000101\000", 10); }));
}

TEST_F(SupervisedCommandTest, ComesBackAfterItWasKilled) {
  Make("sleep 100", true);
  Order(1);
  ASSERT_TRUE(UntilRunning());
  const int pid = command_->pid();
  ::kill(pid, SIGKILL);
  const Stopwatch waited;
  ASSERT_TRUE(Until([&] { return command_->IsRunning() && command_->pid() != pid; }));
  EXPECT_LT(waited.seconds(), 2);
  EXPECT_EQ(said_, "it: killed by Killed, started again\n");
}

TEST_F(SupervisedCommandTest, GivesUpAfterQuickDeathsAndWaitsLongerEachTime) {
  Make("sh -c 'exit 5'", true);
  Order(1);
  Time now = FromUtime(1'000'000);
  std::vector<Time> starts;
  const Stopwatch waited;
  while (command_->given_up().empty() && waited.seconds() < 60) {
    const bool was_running = command_->IsRunning();
    said_ += command_->Step(now);
    if (!was_running && command_->IsRunning()) starts.push_back(now);
    if (command_->IsRunning()) {
      WaitBriefly();  // Real time for the child; the deputy's time stands still.
    } else {
      now += std::chrono::milliseconds(1);
    }
  }
  ASSERT_EQ(starts.size(), 20u);
  EXPECT_EQ(starts[1] - starts[0], std::chrono::milliseconds(10));
  EXPECT_EQ(starts[2] - starts[1], std::chrono::milliseconds(20));
  EXPECT_EQ(starts[19] - starts[18], std::chrono::seconds(1));
  EXPECT_TRUE(said_.ends_with("it: exit status 5, given up after 20 quick deaths in a row\n"));
  command_->Step(now + std::chrono::hours(1));
  EXPECT_FALSE(command_->IsRunning());
  Order(2);  // Until it is ordered to.
  ASSERT_TRUE(UntilRunning());
  EXPECT_EQ(command_->given_up(), "");
}

TEST_F(SupervisedCommandTest, WhatCannotBeStartedIsGivenUpAtOnce) {
  Make("vog-no-such-program", true);
  Order(1);
  said_ = command_->Step({});
  EXPECT_TRUE(said_.starts_with("it: vog-no-such-program: no such program")) << said_;
  EXPECT_NE(command_->given_up(), "");
  EXPECT_EQ(command_->actual_run(), 1);
  EXPECT_EQ(WEXITSTATUS(command_->exit_status()), 127);
}

TEST_F(SupervisedCommandTest, WhatItHasStartedEndsWithIt) {
  Make("sh -c 'sleep 100 & echo $!; wait'");
  Order(1);
  ASSERT_TRUE(UntilSaid("\n"));
  const int grandchild = std::stoi(said_);
  ::kill(command_->pid(), SIGKILL);
  ASSERT_TRUE(UntilEnded());
  // An orphan's status may wait for whoever adopts it.
  const auto has_ended = [&] {
    const std::string stat = "/proc/" + std::to_string(grandchild) + "/stat";
    return !std::filesystem::exists(stat) || ReadFile(stat).find(") Z ") != std::string::npos;
  };
  EXPECT_TRUE(Until(has_ended));
}

TEST_F(SupervisedCommandTest, LongOutputGoesToTwoFiles) {
  ChildOutput output(scratch_.path() / "long.txt", 1000);
  const ChildProcess process({"/bin/sh", {"sh", "-c", "yes 123456789 | head -500"}, {}},
                             output.child_fd());
  std::string read;
  ASSERT_TRUE(StepUntil([&](Time) { read += output.Read(); }, [&] { return read.size() >= 5000; }));
  EXPECT_EQ(read.size(), 5000u);
  EXPECT_LE(std::filesystem::file_size(scratch_.path() / "long.txt"), 5000u);
  output.Read();
  EXPECT_EQ(output.lost_bytes(), 0);
  ChildOutput nowhere("/nosuch/long.txt");
  const ChildProcess other({"/bin/echo", {"echo", "x"}, {}}, nowhere.child_fd());
  ASSERT_TRUE(StepUntil([&](Time) { nowhere.Read(); }, [&] { return nowhere.lost_bytes() == 2; }));
}

}  // namespace
}  // namespace vog
