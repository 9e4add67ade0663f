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

}  // namespace
}  // namespace vog
