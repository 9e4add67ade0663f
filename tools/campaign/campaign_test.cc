#include "tools/campaign/campaign.h"

#include <gtest/gtest.h>

#include "lib/base/errors.h"

namespace vog {
namespace {

TEST(CampaignTest, ReadsSeeds) {
  EXPECT_EQ(ParseSeeds("3..12", "").first, 3);
  EXPECT_EQ(ParseSeeds("3..12", "").last, 12);
  EXPECT_EQ(ParseSeeds("7", "").first, 7);
  EXPECT_EQ(ParseSeeds("7", "").last, 7);
  EXPECT_EQ(ParseSeeds("0..0", "").last, 0);
}

TEST(CampaignTest, RefusesWhatIsNoRangeOfSeeds) {
  for (const char* text : {"", "..", "1..", "..3", "3..1", "-1..2", "1...3", "1..2..3", "a", "1.5",
                           "1-3", "99999999999999999999"})
    EXPECT_THROW(ParseSeeds(text, ""), UsageError) << text;
}

TEST(CampaignTest, ReadsAMission) {
  const MissionId mission = ParseMission("tank-a/12");
  EXPECT_EQ(mission.case_folder, "tank-a");
  EXPECT_EQ(mission.seed, 12);
  for (const char* text : {"", "/", "tank", "tank/", "tank/x", "tank/-1", "tank/1..2", "a/b/1x"})
    EXPECT_THROW(ParseMission(text), UsageError) << text;
}

TEST(CampaignTest, MissionsComeCaseByCase) {
  Campaign campaign{"x", {4, 5}, {}, {}};
  campaign.cases.push_back({"b c", "b-c", Config()});
  campaign.cases.push_back({"a", "a", Config()});
  std::string order;
  for (const MissionId& mission : campaign.Missions()) order += mission.text() + " ";
  EXPECT_EQ(order, "b-c/4 b-c/5 a/4 a/5 ");
}

TEST(CampaignTest, ChoosesCasesByWordsInTheirNames) {
  const auto chosen = [](const std::vector<std::string>& words) {
    Campaign campaign{"x", {1, 1}, {}, {}};
    for (const char* name : {"pier tree", "tank coverage", "tank tree", "mine"})
      campaign.cases.push_back({name, name, Config()});
    std::string names;
    for (const CampaignCase& one : WithCases(std::move(campaign), words).cases)
      names += one.name + ";";
    return names;
  };
  EXPECT_EQ(chosen({}), "pier tree;tank coverage;tank tree;mine;");
  EXPECT_EQ(chosen({"tank"}), "tank coverage;tank tree;");
  EXPECT_EQ(chosen({"mine", "tree"}), "pier tree;tank tree;mine;");
  EXPECT_EQ(chosen({"tank tree"}), "tank tree;");
  EXPECT_THROW(chosen({"tank", "Mine"}), UsageError);
}

}  // namespace
}  // namespace vog
