#include <gtest/gtest.h>

#include "tools/mission/mission.h"

namespace vog {
namespace {

TEST(BudgetUsed, IsThatOfTheBudgetThatEndsFirst) {
  MissionOptions mission;
  mission.max_submaps = 300;
  RunProgress progress;
  progress.submaps = 75;
  progress.vehicle_time_s = 1500;
  EXPECT_DOUBLE_EQ(BudgetUsed(progress, mission), 0.25) << "no budget of time";
  mission.max_duration_s = 3000;
  EXPECT_DOUBLE_EQ(BudgetUsed(progress, mission), 0.5);
  progress.submaps = 240;
  EXPECT_DOUBLE_EQ(BudgetUsed(progress, mission), 0.8);
}

TEST(ProgressWatcher, CountsTimeFromTheFirstMessage) {
  ProgressWatcher watcher;
  EXPECT_EQ(watcher.progress().vehicle_time_s, 0);
  const Time begin{FromSeconds(1.7e9)};  // A vehicle's clock.
  watcher.OnMessage(begin, "NAV", {});
  EXPECT_EQ(watcher.progress().vehicle_time_s, 0);
  watcher.OnMessage(begin + FromSeconds(12.5), "NAV", {});
  EXPECT_DOUBLE_EQ(watcher.progress().vehicle_time_s, 12.5);
}

}  // namespace
}  // namespace vog
