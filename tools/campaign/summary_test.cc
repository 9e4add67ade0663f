#include "tools/campaign/summary.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tools/launch/launch_testing.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

Json Metrics(double vog, double vog_no_lc, double standard, double estimate, double odometry) {
  return {{"submaps", 20},
          {"rmse_m", {{"vog", vog}, {"vog_no_lc", vog_no_lc}, {"standard", standard}}},
          {"position_error_m",
           {{"estimate", {{"mean", estimate}}}, {"odometry", {{"mean", odometry}}}}},
          {"nees_per_dimension", nullptr},
          {"coverage", {{"surface", 0.9}}}};
}

/// Seeds 1 to 4; the third failed.
CaseResults FourMissions() {
  return {"tank",
          {{1, Metrics(0.02, 0.1, 0.2, 0.05, 0.3), ""},
           {2, Metrics(0.04, 0.1, 0.2, 0.06, 0.05), ""},
           {3, nullptr, "disk full"},
           {4, Metrics(0.03, 0.1, 0.2, 0.07, 0.07), ""}}};
}

Campaign OneCase() {
  Campaign campaign{"small", {1, 4}, {}, {}};
  campaign.cases.push_back({"tank", "tank", Config()});
  return campaign;
}

TEST(SummaryTest, LastWordsAreTheSameWhereverAMissionWasFlown) {
  const ScratchFolder scratch;
  std::filesystem::create_directories(scratch.path() / "tank");
  std::ofstream(scratch.path() / "missions.json") << "{}";
  const CampaignFolder folder = CampaignFolder::Join(scratch.path());
  Campaign campaign = OneCase();
  const std::string here = scratch.path().string();
  const auto say = [&](int seed, const std::string& text) {
    std::ofstream(folder.OutputOf({"tank", seed})) << text;
  };
  say(1, "note\nvog: " + here + "/tank/1.part/lcm.log: full\n");
  say(2, "vog: " + here + "/tank/2.part-47_1.0/lcm.log: full\n");
  say(3, "");
  const auto missions = ReadResults(folder, campaign).front().missions;
  EXPECT_EQ(missions[0].error, "tank/1.part/lcm.log: full");
  EXPECT_EQ(missions[1].error, "tank/2.part/lcm.log: full");
  EXPECT_EQ(missions[2].error, "broke off");
  EXPECT_EQ(missions[3].error, "not flown");
}

TEST(SummaryTest, FiguresAreThoseOfTheMissionsThatHaveThem) {
  const Json summary = SummaryOf(FourMissions());
  const Json& rmse = summary["figures"]["rmse_m"]["vog"];
  EXPECT_EQ(rmse["n"], 3);
  EXPECT_NEAR(rmse["mean"].get<double>(), 0.03, 1e-15);
  EXPECT_NEAR(rmse["standard_deviation"].get<double>(), 0.01, 1e-15);
  // t = 4.302652729749464 for 2 degrees of freedom.
  EXPECT_NEAR(rmse["interval_95"][1].get<double>(), 0.03 + 4.302652729749464 * 0.01 / std::sqrt(3),
              1e-12);
  EXPECT_TRUE(summary["figures"]["nees_per_dimension"].is_null());
  EXPECT_FALSE(summary["figures"].contains("timing"));
}

TEST(SummaryTest, RatiosAreThoseOfTheMeans) {
  const Json summary = SummaryOf(FourMissions());
  EXPECT_NEAR(summary["ratios"]["rmse_m_vog_to_vog_no_lc"]["value"].get<double>(), 0.3, 1e-15);
  EXPECT_NEAR(summary["ratios"]["rmse_m_vog_to_standard"]["value"].get<double>(), 0.15, 1e-15);
}

TEST(SummaryTest, ClosuresAreComparedSeedBySeed) {
  const Json pairs = SummaryOf(FourMissions())["closures_against_none"];
  EXPECT_EQ(pairs["rmse_m"]["worse"], 0);
  EXPECT_NEAR(pairs["rmse_m"]["difference"]["mean"].get<double>(), -0.07, 1e-15);
  EXPECT_EQ(pairs["rmse_m"]["wilcoxon_p"], 0.25);                  // Three of one sign: 2 of 8.
  EXPECT_EQ(pairs["position_error_m"]["worse_seeds"], Json({2}));  // 4 is equal.
}

TEST(SummaryTest, FailuresAreToldAndDoNotCount) {
  const Json summary = SummaryOf(FourMissions());
  EXPECT_EQ(summary["missions"], 4);
  EXPECT_EQ(summary["failed"], Json::array({{{"seed", 3}, {"error", "disk full"}}}));
  const std::string table = TableOf(SummaryOf(OneCase(), {FourMissions()}));
  EXPECT_NE(table.find("3 of 4"), std::string::npos) << table;
  EXPECT_NE(table.find("failed: tank, seed 3: disk full"), std::string::npos) << table;
}

TEST(SummaryTest, TheTableShowsWhatTheJsonHolds) {
  const std::string table = TableOf(SummaryOf(OneCase(), {FourMissions()}));
  for (const char* text :
       {"small, seeds 1 to 4", "RMSE, VOG-map with closures [m]", "0.030 ± 0.010 [0.005, 0.055]",
        "Surface seen [%]", "90.0 ± 0.0", "RMSE with closures : without", "0.300 [",
        "Position error, worse with closures", "1: seeds 2"})
    EXPECT_NE(table.find(text), std::string::npos) << text << "\n" << table;
}

TEST(SummaryTest, ColumnsStandBelowEachOther) {
  CaseResults other = FourMissions();
  other.name = "a case with a long name";
  const std::string table = TableOf(SummaryOf(OneCase(), {other, FourMissions()}));
  const auto place_in_line = [&](const std::string& text) {
    const std::size_t at = table.rfind(text);
    return at - table.rfind('\n', at);
  };
  EXPECT_EQ(place_in_line("tank\n"), place_in_line("3 of 4\n"));
  // "±" takes two bytes in the first column.
  EXPECT_EQ(place_in_line("tank\n") + 1, place_in_line("0.030 ± 0.010"));
}

TEST(SummaryTest, OneMissionHasNoIntervalsAndNoneNothing) {
  CaseResults results = FourMissions();
  results.missions.resize(1);
  const Json one = SummaryOf(results);
  EXPECT_TRUE(one["figures"]["rmse_m"]["vog"]["interval_95"].is_null());
  EXPECT_TRUE(one["ratios"]["rmse_m_vog_to_standard"]["interval_95"].is_null());
  results.missions = {{1, nullptr, "not flown"}};
  const Json none = SummaryOf(results);
  EXPECT_TRUE(none["figures"]["rmse_m"]["vog"].is_null());
  EXPECT_TRUE(none["ratios"]["rmse_m_vog_to_standard"].is_null());
  EXPECT_TRUE(none["closures_against_none"]["rmse_m"]["difference"].is_null());
  EXPECT_NE(TableOf(SummaryOf(OneCase(), {results})).find("–"), std::string::npos);
}

}  // namespace
}  // namespace vog
