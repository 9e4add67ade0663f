#include "tools/report/report.h"

#include <algorithm>

#include "lib/base/errors.h"
#include "tools/report/gnuplot.h"
#include "tools/report/run_folder_testing.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

class ReportTest : public RunFolderTest {
 protected:
  void SetUp() override {
    if (!HasGnuplot()) GTEST_SKIP() << "gnuplot is not installed";
  }

  static std::string ReportOf(const fs::path& folder) {
    WriteReport(folder);
    return ReadFile(folder / "report.html");
  }
};

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

/// What the page says of a section, pictures left out.
std::string Section(const std::string& page, const std::string& id) {
  const std::size_t start = page.find("<section id=\"" + id + "\"");
  if (start == std::string::npos) return "";
  return page.substr(start, page.find("</section>", start) - start);
}

void ExpectUsageError(const std::function<void()>& body, const std::string& part) {
  try {
    body();
    FAIL() << "nothing thrown for " << part;
  } catch (const UsageError& error) {
    EXPECT_TRUE(Has(error.what(), part)) << error.what();
    EXPECT_FALSE(Has(error.what(), "\n")) << error.what();
  }
}

TEST_F(ReportTest, HasEverythingAndNeedsNothing) {
  const std::string page = ReportOf(MakeRun("run", {}));
  EXPECT_TRUE(Has(page, "<h1>box · mode vog · seed 3 · 3 submaps</h1>"));
  const std::map<std::string, int> pictures = {
      {"figures", 0},   {"reconstruction", 1}, {"paths", 2},    {"progress", 2},
      {"occupancy", 4}, {"graph", 1},          {"closures", 3}, {"consistency", 1},
      {"timing", 1},    {"parameters", 0},     {"reproduce", 0}};
  for (const auto& [id, count] : pictures) {
    EXPECT_FALSE(Section(page, id).empty()) << id;
    EXPECT_EQ(Count(Section(page, id), "<img "), count) << id;
  }
  EXPECT_EQ(Count(page, "<img "), Count(page, "alt=\""));
  EXPECT_EQ(Count(page, "<img "), Count(page, "src=\"data:image/"));
  EXPECT_FALSE(Has(page, "class=\"missing\""));
  for (const char* outside : {"<script", "<link", "http:", "https:", "@import"})
    EXPECT_FALSE(Has(page, outside)) << outside;
  EXPECT_LT(page.size(), 3'000'000u);
}

TEST_F(ReportTest, DrawsTheMapWithAndWithoutClosures) {
  const std::string occupancy = Section(ReportOf(MakeRun("run", {})), "occupancy");
  const auto picture = [&](const std::string& alt) {
    const std::size_t at = occupancy.find("alt=\"" + alt);
    const std::size_t begin = occupancy.find("src=", at);
    return at == std::string::npos ? ""
                                   : occupancy.substr(begin, occupancy.find('>', begin) - begin);
  };
  const std::string corrected = picture("Occupied voxels of the map from above");
  const std::string reckoned = picture("Occupied voxels from above without closures");
  EXPECT_FALSE(corrected.empty());
  EXPECT_FALSE(reckoned.empty());
  EXPECT_NE(corrected, reckoned);  // All odometry poses of this run are the same.
}

TEST_F(ReportTest, ShowsTheNumbers) {
  const std::string page = ReportOf(MakeRun("run", {}));
  const std::string figures = Section(page, "figures");
  for (const char* cell : {"0.052 m", "91.4 %", "42 s", "12.5 s", "–"})
    EXPECT_TRUE(Has(figures, std::string("<td>") + cell + "</td>")) << cell;
  EXPECT_TRUE(Has(Section(page, "graph"), "3 submaps, 1 full and 1 partial loop closures"));
  EXPECT_TRUE(Has(Section(page, "graph"), "disagrees with the odometry"));
  EXPECT_TRUE(Has(Section(page, "timing"), "vog-planner"));
  EXPECT_TRUE(Has(Section(page, "parameters"), "name = &quot;box&quot;"));
  EXPECT_TRUE(Has(Section(page, "reproduce"), "--mode vog --seed 3"));
}

TEST_F(ReportTest, ListsLoopClosures) {
  const std::string closures = Section(ReportOf(MakeRun("run", {})), "closures");
  for (const char* cell : {"full", "partial", "holds", "0.0", "0.000"})
    EXPECT_TRUE(Has(closures, std::string("<td>") + cell + "</td>")) << cell;
  for (const char* pair : {"0–2", "0–1"})
    EXPECT_TRUE(Has(closures, std::string("<th scope=\"row\">") + pair + "</th>")) << pair;
  const std::string folded = closures.substr(closures.find("<details>"));
  EXPECT_TRUE(Has(folded, "1 were tried and rejected"));
  EXPECT_TRUE(Has(folded, "<th scope=\"row\">1–2</th>"));
  EXPECT_TRUE(Has(folded, "<td>disagrees with the odometry</td>"));
}

TEST_F(ReportTest, ShowsClosuresAsBeforeAndAfter) {
  const std::string closures = Section(ReportOf(MakeRun("run", {})), "closures");
  EXPECT_TRUE(Has(closures, "alt=\"Submaps 0–2 from above, before and after registration\""));
  EXPECT_TRUE(Has(closures, "0–2 at 0.0 s: full, moved 0.00 m"));
}

TEST_F(ReportTest, BoundsThePicturesOfClosures) {
  Options options;
  options.more_closures = 60;
  const std::string page = ReportOf(MakeRun("run", options));
  const std::string closures = Section(page, "closures");
  EXPECT_TRUE(Has(closures, "Of 62 closures those 24 that move most."));
  EXPECT_EQ(Count(closures, "<img "), 24 + 1);
  EXPECT_EQ(Count(closures, "<th scope=\"row\">"), 62 + 1);
  EXPECT_LT(page.size(), 3'000'000u);
}

TEST_F(ReportTest, ClosuresOfLostSubmapsHaveARowAlone) {
  Options options;
  options.lost_submap = 2;
  const std::string closures = Section(ReportOf(MakeRun("run", options)), "closures");
  EXPECT_EQ(Count(closures, "<img "), 1);  // 0-1 has both.
  EXPECT_TRUE(Has(closures, "<th scope=\"row\">0–2</th>"));
}

TEST_F(ReportTest, ShowsConsistencyBesideItsBand) {
  const std::string consistency = Section(ReportOf(MakeRun("run", {})), "consistency");
  EXPECT_TRUE(Has(consistency, "0.07 to 3.12"));
  EXPECT_TRUE(Has(consistency, "the mean is 1.25, and 90 % of the submaps"));
}

TEST_F(ReportTest, DependsOnTheContentAlone) {
  const fs::path folder = MakeRun("run", {});
  const std::string page = ReportOf(folder);
  EXPECT_EQ(ReportOf(folder), page);
  const fs::path other = root() / "a place 'elsewhere' & so on";
  fs::copy(folder, other, fs::copy_options::recursive);
  EXPECT_EQ(ReportOf(other), page);
}

TEST_F(ReportTest, EscapesWhatIsNotItsOwn) {
  const std::string evil = "<script>alert('&\"')</script>";
  Options options;
  options.scene = options.mode = options.reason = evil;
  options.config_toml = "[mission]\nname = '''" + evil + "'''\n";
  const std::string page = ReportOf(MakeRun("run", options));
  EXPECT_FALSE(Has(page, "<script"));
  EXPECT_GE(Count(page, "&lt;script&gt;alert(&#39;&amp;&quot;&#39;)&lt;/script&gt;"), 5);
}

TEST_F(ReportTest, RefusesWhatIsNoFinishedRun) {
  ExpectUsageError([&] { WriteReport(root() / "nowhere"); }, "nowhere: no such folder");
  for (const char* part : {"lcm.log", "map", "metrics.json", "timing.json"}) {
    const fs::path folder = MakeRun(std::string("without ") + part, {});
    fs::remove_all(folder / part);
    ExpectUsageError([&] { WriteReport(folder); }, std::string("not a finished run: no ") + part);
    EXPECT_FALSE(fs::exists(folder / "report.html"));
  }
  const fs::path damaged = MakeRun("damaged", {});
  WriteFileAtomically(damaged / "metrics.json", "{\"scene\": ");
  ExpectUsageError([&] { WriteReport(damaged); }, "metrics.json: damaged");
}

TEST_F(ReportTest, SaysWhatALiveRunHasNot) {
  Options options;
  options.has_planning = false;
  options.config_toml = "[bus]\nclock = \"message\"\n[live]\nspeed = 20.0\n";
  const std::string page = ReportOf(MakeRun("run", options));
  EXPECT_EQ(Count(page, "class=\"missing\""), 1);
  EXPECT_TRUE(Has(Section(page, "timing"), "No times of planning steps"));
  EXPECT_TRUE(Has(Section(page, "reproduce"), "--seed 3 --live --speed 20 --out"));
}

TEST_F(ReportTest, SaysWhatARunWithoutTruthHasNot) {
  Options options;
  options.has_truth = false;
  const std::string page = ReportOf(MakeRun("run", options));
  EXPECT_TRUE(Has(page, "<h1>box · mode vog · seed 3 · 3 submaps</h1>"));
  for (const char* id : {"figures", "reconstruction", "paths", "progress", "consistency"})
    EXPECT_TRUE(Has(Section(page, id), "class=\"missing\"")) << id;
  EXPECT_EQ(Count(Section(page, "paths"), "<img "), 2);
  EXPECT_EQ(Count(Section(page, "occupancy"), "<img "), 4);
  EXPECT_TRUE(Has(Section(page, "figures"), "<td>3</td>"));
  EXPECT_FALSE(Has(Section(page, "figures"), "RMSE"));
  EXPECT_FALSE(Has(page, "vog mission"));
  EXPECT_TRUE(Has(page, "vog replay"));
}

TEST_F(ReportTest, BearsTheLossOfPictures) {
  const fs::path folder = MakeRun("run", {});
  for (const char* name : {"timeseries.json", "truth.tum", "odometry.tum", "estimate.tum",
                           "scene.ply", "reconstruction_truth.ply"})
    fs::remove(folder / name);
  EXPECT_TRUE(Has(ReportOf(folder), "no reconstructions"));
  WriteCloud(folder / "reconstruction_truth.ply", {{0, 0, 0}});
  WriteCloud(folder / "reconstruction_vog.ply", {{0, 0, 1}});
  fs::remove(folder / "reconstruction_standard.ply");
  EXPECT_TRUE(Has(ReportOf(folder), "<img "));
}

TEST_F(ReportTest, ComparesRunsByModeAndScene) {
  std::vector<fs::path> folders;
  for (int seed = 1; seed <= 3; ++seed) {
    Options options;
    options.seed = seed;
    options.rmse_m = 0.1 * seed;
    folders.push_back(MakeRun("vog" + std::to_string(seed), options));
  }
  Options options;
  options.mode = "standard";
  options.scene = "<b>";
  folders.push_back(MakeRun("standard <&>", options));
  const fs::path out = root() / "comparison.html";
  WriteComparison(folders, out);
  const std::string page = ReadFile(out);
  const std::string figures = Section(page, "figures");
  EXPECT_TRUE(Has(figures, "<th scope=\"col\">box, vog</th>"));
  EXPECT_TRUE(Has(figures, "<th scope=\"col\">&lt;b&gt;, standard</th>"));
  EXPECT_TRUE(Has(figures, "<td>0.200 ± 0.100</td>"));
  EXPECT_TRUE(Has(page, "standard &lt;&amp;&gt;"));
  EXPECT_EQ(Count(page, "<img "), 3);
  WriteComparison(folders, out);
  EXPECT_EQ(ReadFile(out), page);
}

TEST_F(ReportTest, ComparesFinishedRunsOnly) {
  const fs::path run = MakeRun("run", {});
  fs::create_directory(root() / "empty");
  ExpectUsageError(
      [&] {
        WriteComparison({run, root() / "empty"}, root() / "out.html");
      },
      "empty: not a finished run");
  ExpectUsageError([&] { WriteComparison({}, root() / "out.html"); }, "at least one");
  EXPECT_FALSE(fs::exists(root() / "out.html"));
}

}  // namespace
}  // namespace vog
