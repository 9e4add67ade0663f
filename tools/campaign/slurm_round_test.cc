#include "tools/campaign/slurm_round.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "lib/base/errors.h"
#include "tools/launch/launch_testing.h"

namespace vog {
namespace {

std::vector<MissionId> Missions(int count) {
  std::vector<MissionId> missions;
  for (int seed = 1; seed <= count; ++seed) missions.push_back({"tank", seed});
  return missions;
}

class SlurmRoundTest : public ::testing::Test {
 protected:
  SlurmRoundTest() { folder_.Prepare(); }

  void Damage(const std::string& file, const std::string& text) {
    std::ofstream(scratch_.path() / "slurm" / file) << text;
  }

  ScratchFolder scratch_;
  SlurmFolder folder_{scratch_.path()};
};

TEST_F(SlurmRoundTest, TasksGrowWithTheCampaign) {
  EXPECT_EQ(MissionsPerTask(1), 1);
  EXPECT_EQ(MissionsPerTask(250), 1);
  EXPECT_EQ(MissionsPerTask(251), 2);
  EXPECT_EQ(MissionsPerTask(5000), 20);
  EXPECT_EQ(MissionsPerTask(25000), 100);
  EXPECT_EQ(MissionsPerTask(100000), 100);
  EXPECT_EQ(MissionsPerTask(100001), 101);
}

TEST_F(SlurmRoundTest, EachMissionIsInOneTask) {
  for (const int count : {1, 2, 7, 100})
    for (const int per_task : {1, 3, 7, 200}) {
      const auto tasks = DealOut(Missions(count), per_task);
      EXPECT_EQ(tasks.size(), static_cast<std::size_t>((count + per_task - 1) / per_task));
      std::set<std::string> dealt;
      for (const auto& task : tasks) {
        EXPECT_FALSE(task.empty());
        EXPECT_LE(task.size(), static_cast<std::size_t>(per_task));
        for (const MissionId& mission : task) EXPECT_TRUE(dealt.insert(mission.text()).second);
      }
      EXPECT_EQ(dealt.size(), static_cast<std::size_t>(count));
    }
}

TEST_F(SlurmRoundTest, ReadsWhatItWrote) {
  folder_.Write(SlurmOrder{{3, 9}, {"tank", "pier tree"}, 20, 5, {"--time=1:00", "-p", "a b"}});
  const SlurmOrder order = folder_.ReadOrder();
  EXPECT_EQ(order.seeds.first, 3);
  EXPECT_EQ(order.seeds.last, 9);
  EXPECT_EQ(order.cases, (std::vector<std::string>{"tank", "pier tree"}));
  EXPECT_EQ(order.tasks_at_a_time, 20);
  EXPECT_EQ(order.missions_per_task, 5);
  EXPECT_EQ(order.arguments, (std::vector<std::string>{"--time=1:00", "-p", "a b"}));
  EXPECT_EQ(folder_.ReadRound().number, 0);
  folder_.Write(SlurmRound{2, 17, 1, "4711"});
  const SlurmRound round = folder_.ReadRound();
  EXPECT_EQ(round.number, 2);
  EXPECT_EQ(round.finished, 17u);
  EXPECT_EQ(round.fruitless, 1);
  EXPECT_EQ(round.job, "4711");
  folder_.WriteTasks(2, DealOut(Missions(5), 2));
  std::string read;
  for (const int task : {1, 2, 3})
    for (const MissionId& mission : folder_.ReadTask(2, task)) read += mission.text() + " ";
  EXPECT_EQ(read, "tank/1 tank/4 tank/2 tank/5 tank/3 ");
}

TEST_F(SlurmRoundTest, RefusesDamage) {
  EXPECT_THROW(folder_.ReadOrder(), SystemError);
  for (const char* text : {"", "{", "[]", "{\"round\": \"x\"}", "{\"round\": 1}"}) {
    Damage("round.json", text);
    Damage("order.json", text);
    EXPECT_THROW(folder_.ReadRound(), UsageError) << text;
    EXPECT_THROW(folder_.ReadOrder(), UsageError) << text;
  }
  EXPECT_THROW(folder_.ReadTask(1, 1), SystemError);
  Damage("tasks-1.txt", "tank/1\ntank/x tank/2\ntank\n");
  EXPECT_EQ(folder_.ReadTask(1, 1).size(), 1u);
  for (const int task : {-1, 0, 2, 3, 4}) EXPECT_THROW(folder_.ReadTask(1, task), UsageError);
}

}  // namespace
}  // namespace vog
