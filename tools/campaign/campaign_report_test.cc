#include "tools/campaign/campaign_report.h"

#include <gtest/gtest.h>

#include <fstream>

#include "lib/base/files.h"
#include "tools/launch/launch_testing.h"
#include "tools/report/gnuplot.h"

namespace vog {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kEvil = "<script>alert('&\"')</script>";

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// What the page says of a section.
std::string Section(const std::string& page, const std::string& id) {
  const std::size_t start = page.find("<section id=\"" + id + "\"");
  if (start == std::string::npos) return "";
  return page.substr(start, page.find("</section>", start) - start);
}

class CampaignReportTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasGnuplot()) GTEST_SKIP() << "gnuplot is not installed";
    fs::create_directories(scratch_.path());
    WriteFileAtomically(scratch_.path() / "missions.json", "{}");
    campaign_.name = "small";
    campaign_.seeds = {1, 3};
    AddCase("tank", "[mission]\nmax_submaps = 3\n");
    AddCase("random walk", "[mission]\nmax_submaps = 3\n[drift]\nscaling = 'random_walk'\n");
  }

  void AddCase(const std::string& name, const std::string& toml) {
    std::string folder = name;
    std::replace(folder.begin(), folder.end(), ' ', '-');
    campaign_.cases.push_back({name, folder, Config::Parse(toml, "test")});
    for (std::int64_t seed = 1; seed <= 2; ++seed) WriteResult({folder, seed});
  }

  /// The third seed has none.
  void WriteResult(const MissionId& id, const std::string& end_reason = "max_submaps") {
    const fs::path folder = scratch_.path() / id.text();
    fs::create_directories(folder);
    const double error_m = 0.1 * static_cast<double>(id.seed);
    const Json metrics = {
        {"end_reason", end_reason},
        {"submaps", 3},
        {"rmse_m", {{"vog", error_m}, {"vog_no_lc", 2 * error_m}, {"standard", 3 * error_m}}},
        {"coverage", {{"surface", 0.5}}}};
    WriteFileAtomically(folder / "metrics.json", metrics.dump());
    WriteFileAtomically(folder / "timeseries.json",
                        R"({"surface": [[0, 0], [1, 0.25], [2, 0.5]]})");
    WriteTiming(id, 0.02);
  }

  void WriteTiming(const MissionId& id, double wall_s) {
    const Json timing = {{"wall_s", 1}, {"planning", {{{"submaps", 1}, {"wall_s", wall_s}}}}};
    WriteFileAtomically(scratch_.path() / id.text() / "timing.json", timing.dump());
  }

  std::string Page() {
    WriteTables(CampaignFolder::Join(scratch_.path()), campaign_);
    return ReadFile(scratch_.path() / "campaign.html");
  }

  const fs::path& path() const { return scratch_.path(); }

  Campaign campaign_;

 private:
  ScratchFolder scratch_;
};

TEST_F(CampaignReportTest, HasEverythingAndNeedsNothing) {
  const std::string page = Page();
  EXPECT_TRUE(Has(page, "<h1>Campaign small</h1>"));
  EXPECT_TRUE(Has(page, "4 of 6 missions: seeds 1 to 3 of 2 cases."));
  EXPECT_TRUE(Has(Section(page, "maps"), "<td>0.150 ± 0.071 [-0.485, 0.785]</td>"));
  EXPECT_TRUE(Has(Section(page, "maps"), "<td>not flown</td>"));
  for (const char* id : {"errors", "progress", "timing"})
    EXPECT_TRUE(Has(Section(page, id), "src=\"data:image/")) << id;
  EXPECT_TRUE(Has(Section(page, "figures"), "Surface seen [%]"));
  EXPECT_TRUE(Has(Section(page, "settings"), "<th scope=\"row\">drift.scaling</th>"));
  EXPECT_TRUE(Has(Section(page, "settings"), "<td>default</td>"));
  EXPECT_FALSE(Has(Section(page, "settings"), "<th scope=\"row\">mission.max_submaps</th>"));
  EXPECT_TRUE(Has(Section(page, "reproduce"), "--seeds 1..3"));
  for (const char* outside : {"<script", "<link", "http:", "https:", "@import"})
    EXPECT_FALSE(Has(page, outside)) << outside;
}

TEST_F(CampaignReportTest, LeadsToReportsThatAreKept) {
  WriteFileAtomically(path() / "random-walk/2/report.html", "");
  const std::string missions = Section(Page(), "missions");
  EXPECT_TRUE(Has(missions, "<a href=\"random-walk/2/report.html\">2</a>"));
  EXPECT_FALSE(Has(missions, "tank/1/report.html"));
}

TEST_F(CampaignReportTest, IsTheSameAnywhereButForPlanningTimes) {
  const std::string page = Page();
  EXPECT_EQ(Page(), page);
  WriteTiming({"tank", 1}, 3);
  const std::string slower = Page();
  EXPECT_NE(Section(slower, "timing"), Section(page, "timing"));
  for (const char* id : {"maps", "errors", "progress", "figures", "missions", "settings"})
    EXPECT_EQ(Section(slower, id), Section(page, id)) << id;
}

TEST_F(CampaignReportTest, EscapesWhatIsNotItsOwn) {
  campaign_.name = kEvil;
  campaign_.cases[0].name = kEvil;
  campaign_.cases[0].mission =
      Config::Parse("[mission]\nname = '''" + std::string(kEvil) + "'''\n", "test");
  WriteResult({"tank", 1}, kEvil);
  std::ofstream(path() / "tank" / "3.txt") << "vog: " << kEvil << "\n";
  const std::string page = Page();
  EXPECT_FALSE(Has(page, "<script"));
  for (const char* id : {"maps", "errors", "figures", "missions", "settings", "reproduce"})
    EXPECT_TRUE(Has(Section(page, id), "&lt;script&gt;")) << id;
}

TEST_F(CampaignReportTest, SaysWhatThereIsNot) {
  for (const CampaignCase& one : campaign_.cases) fs::remove_all(path() / one.folder);
  campaign_.cases.pop_back();
  const std::string page = Page();
  for (const char* id : {"errors", "progress", "timing", "missions", "settings"})
    EXPECT_TRUE(Has(Section(page, id), "class=\"missing\"")) << id;
}

TEST_F(CampaignReportTest, BearsDamagedSeries) {
  WriteFileAtomically(path() / "tank/1/timeseries.json", R"({"surface": [[0], "x", [1, null]]})");
  WriteFileAtomically(path() / "tank/1/timing.json", R"({"planning": [1, {"submaps": "x"}]})");
  EXPECT_TRUE(Has(Section(Page(), "progress"), "<img "));
}

TEST_F(CampaignReportTest, ManyCasesFit) {
  for (int i = 0; i < 12; ++i) AddCase("a long name " + std::to_string(i), "");
  EXPECT_TRUE(Has(Section(Page(), "errors"), "<img "));
}

}  // namespace
}  // namespace vog
