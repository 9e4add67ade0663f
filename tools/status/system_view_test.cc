#include "tools/status/system_view.h"

#include <gtest/gtest.h>

#include <random>

#include "lib/messages/endpoint.h"
#include "tools/launch/procman_messages.h"
#include "tools/status/render.h"

namespace vog {
namespace {

const Time kBegan = FromUtime(1'000'000'000);

status_t StatusOf(const std::string& process, std::int64_t epoch = 1) {
  status_t status{};
  status.header.sender = process;
  status.header.epoch = epoch;
  status.process = process;
  status.health = "ok";
  for (const auto& [name, value] : {std::pair{"zero", 0}, {"submaps", 12}, {"missed", 3}}) {
    counter_t counter{};
    counter.name = name;
    counter.value = value;
    status.counter.push_back(counter);
  }
  status.counters = 3;
  return status;
}

class SystemViewTest : public ::testing::Test {
 protected:
  template <class Message>
  void Say(const Channel<Message>& channel, const Message& message, double at_s) {
    view_.OnMessage(At(at_s), channel.name, Encode(message));
  }
  static Time At(double s) { return kBegan + FromSeconds(s); }
  std::string TextAt(double s) const {
    std::string text;
    for (const std::string& line : RenderText(view_, At(s))) text += line + "\n";
    return text;
  }

  SystemView view_{kBegan};
};

TEST_F(SystemViewTest, KnowsProcessesTheirRatesAndRestarts) {
  for (int i = 0; i < 4; ++i) {
    Say(outputs::kStatus, StatusOf("vog-slam", i < 3 ? 1 : 2), i);
    for (int k = 0; k < 9; ++k) {
      pose_estimate_t pose{};
      pose.header.sender = "vog-slam";
      Say(outputs::kPose, pose, i + 0.1 * k);
    }
    view_.Sample(At(i + 1));
  }
  const SystemView::Process& process = view_.processes().at("vog-slam");
  EXPECT_NEAR(process.messages.rate_hz(), 10, 1e-9);
  EXPECT_EQ(process.restarts, 1);
  EXPECT_NEAR(view_.channels().at("POSE").messages.rate_hz(), 9, 1e-9);
  const std::string text = TextAt(4);
  EXPECT_NE(text.find("missed 3  submaps 12"), std::string::npos) << text;
  EXPECT_EQ(text.find("zero"), std::string::npos) << text;
  EXPECT_EQ(text.find("silent"), std::string::npos) << text;
  EXPECT_NE(TextAt(7).find("silent for 4 s"), std::string::npos);
  const auto json = RenderJson(view_, At(7));
  EXPECT_TRUE(json["processes"]["vog-slam"]["silent"]);
  EXPECT_EQ(json["processes"]["vog-slam"]["counters"]["submaps"], 12);
}

TEST_F(SystemViewTest, ShowsDeputiesMissionAndMap) {
  bot_procman::info2_t info{};
  info.host = "vehicle";
  info.cmds.resize(3);
  info.ncmds = 3;
  info.cmds[0].cmd.command_name = "slam";
  info.cmds[0].pid = 77;
  info.cmds[1].cmd.command_name = "sim";
  info.cmds[1].actual_runid = 1;
  info.cmds[1].exit_code = 3 << 8;
  info.cmds[2].cmd.command_name = "loop\033[2J";
  info.cmds[2].actual_runid = 1;
  procman::SetGivenUp(info.cmds[2].cmd, "why");
  Say(procman::kInfo, info, 0);
  mission_status_t mission{};
  mission.state = "exploring";
  Say(outputs::kMissionStatus, mission, 0);
  map_status_t map{};
  map.submaps = 5;
  map.fault = "disk full";
  Say(outputs::kMapStatus, map, 0);
  const std::string text = TextAt(1);
  for (const char* part :
       {"deputy vehicle", "77", "runs", "exit status 3", "loop?[2J", "given up: why",
        "mission  exploring", "map      5 submaps", "disk full"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  const auto json = RenderJson(view_, At(1));
  EXPECT_EQ(json["deputies"]["vehicle"]["commands"]["slam"]["pid"], 77);
  EXPECT_EQ(json["mission"]["state"], "exploring");
  EXPECT_EQ(json["map"]["submaps"], 5);
}

TEST_F(SystemViewTest, AnyBytesDoNoHarm) {
  std::mt19937 random(1);
  const auto good = Encode(StatusOf("vog-slam"));
  for (int i = 0; i < 2000; ++i) {
    auto bytes = good;
    bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    if (i % 3 == 0) bytes.resize(random() % bytes.size());
    view_.OnMessage(At(1), i % 2 ? "STATUS" : "OTHER", bytes);
  }
  view_.Sample(At(2));
  EXPECT_EQ(view_.channels().size(), 2u);
  EXPECT_EQ(view_.channels().at("OTHER").messages.count(), 1000);
  EXPECT_FALSE(TextAt(2).empty());
}

}  // namespace
}  // namespace vog
