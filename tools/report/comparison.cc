#include <algorithm>
#include <array>
#include <map>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "tools/report/curves.h"
#include "tools/report/html.h"
#include "tools/report/key_figures.h"
#include "tools/report/map_errors.h"
#include "tools/report/pictures.h"
#include "tools/report/report.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

/// Runs of one scene and mode.
struct Group {
  std::string name, colour;
  std::vector<const RunNumbers*> runs;
};

/// The place of a mode among the others; unknown ones come last, by name.
std::pair<int, std::string> ModeRank(const std::string& mode) {
  constexpr std::array<const char*, 3> kModes = {"vog", "vog-no-lc", "standard"};
  const auto found = std::find(kModes.begin(), kModes.end(), mode);
  return {static_cast<int>(found - kModes.begin()), mode};
}

std::vector<Group> GroupRuns(const std::vector<RunNumbers>& runs) {
  std::map<std::pair<std::string, std::pair<int, std::string>>, Group> sorted;
  for (const RunNumbers& run : runs) {
    const std::string scene = TextAt(run.metrics, "/scene"), mode = TextAt(run.metrics, "/mode");
    Group& group = sorted[{scene, ModeRank(mode)}];
    group.name = scene + ", " + mode;
    group.runs.push_back(&run);
  }
  std::vector<Group> groups;
  for (auto& [key, group] : sorted) {
    group.colour = GroupColour(groups.size());
    groups.push_back(std::move(group));
  }
  return groups;
}

std::string SpreadTable(const std::vector<Group>& groups) {
  std::vector<std::vector<std::string>> rows = {{""}, {"Runs"}};
  for (const Group& group : groups) {
    rows[0].push_back(group.name);
    rows[1].push_back(std::to_string(group.runs.size()));
  }
  for (const KeyFigure& figure : KeyFigures()) {
    std::vector<std::string> row = {figure.label +
                                    (figure.unit.empty() ? "" : " [" + figure.unit + "]")};
    for (const Group& group : groups) {
      std::vector<std::optional<double>> values;
      for (const RunNumbers* run : group.runs)
        values.push_back(ValueOf(figure, run->metrics, run->timing));
      row.push_back(ShowSpread(figure, values));
    }
    rows.push_back(std::move(row));
  }
  return "<p>Mean ± standard deviation over the runs of a scene and mode.</p>\n" +
         HtmlWide(HtmlTable(rows));
}

/// One line a run, one colour and one entry in the key a group.
Chart ChartOf(const std::vector<Group>& groups, const std::string& key, double scale) {
  Chart chart;
  chart.x_label = "vehicle time [s]";
  for (const Group& group : groups) {
    bool is_named = false;
    for (const RunNumbers* run : group.runs) {
      Curve curve{is_named ? "" : group.name, group.colour, SeriesPoints(run->series, key), 1.1};
      for (auto& point : curve.points) point.second *= scale;
      is_named |= !curve.points.empty();
      chart.curves.push_back(std::move(curve));
    }
  }
  return chart;
}

std::string CurvesHtml(const std::vector<Group>& groups) {
  Chart surface = ChartOf(groups, "surface", 100);
  Chart error = ChartOf(groups, "estimate_error_m", 1);
  if (!HasPoints(surface.curves) || !HasPoints(error.curves))
    return HtmlMissing("The folders have no time series.");
  surface.y_label = "surface seen [%]";
  surface.max_y = 100;
  surface.guides = {90};
  error.y_label = "position error of the estimate [m]";
  return HtmlRow({HtmlFigure(DrawChart(surface), "Surface coverage of all runs over time",
                             "The share of the reachable surface that was truly seen."),
                  HtmlFigure(DrawChart(error), "Position error of all runs over time",
                             "The estimate's distance from the true position.")});
}

/// The error of each run's maps, side by side in each group.
Picture DrawErrors(const std::vector<Group>& groups) {
  std::vector<ErrorGroup> shown;
  for (const Group& group : groups) {
    shown.push_back({group.name, {}});
    for (const RunNumbers* run : group.runs) shown.back().metrics.push_back(&run->metrics);
  }
  return DrawMapErrors(shown);
}

std::string RunTable(const std::vector<Group>& groups) {
  std::vector<std::vector<std::string>> rows = {
      {"Folder", "scene, mode", "seed", "submaps", "RMSE VOG-map [m]", "without closures [m]",
       "standard [m]", "surface [%]", "collisions", "ended"}};
  const auto show = [](const RunNumbers& run, const char* pointer, int digits, double scale = 1) {
    const auto value = NumberAt(run.metrics, pointer);
    return value ? PlotNumber(scale * *value, digits) : std::string("–");
  };
  for (const Group& group : groups)
    for (const RunNumbers* run : group.runs)
      rows.push_back({run->name, group.name, show(*run, "/seed", 12), show(*run, "/submaps", 6),
                      show(*run, "/rmse_m/vog", 3), show(*run, "/rmse_m/vog_no_lc", 3),
                      show(*run, "/rmse_m/standard", 3), show(*run, "/coverage/surface", 3, 100),
                      show(*run, "/collisions", 6), TextAt(run->metrics, "/end_reason")});
  return HtmlWide(HtmlTable(rows));
}

}  // namespace

void WriteComparison(const std::vector<std::filesystem::path>& folders,
                     const std::filesystem::path& out) {
  if (folders.empty()) throw UsageError("name at least one folder of a finished run");
  std::vector<RunNumbers> runs;
  for (const auto& folder : folders) runs.push_back(ReadRunNumbers(folder));
  const std::vector<Group> groups = GroupRuns(runs);
  const std::string title = "Comparison of " + std::to_string(runs.size()) + " runs";
  const std::string body =
      "<h1>" + EscapeHtml(title) + "</h1>\n" +
      HtmlSection("figures", "Key figures", SpreadTable(groups)) +
      HtmlSection(
          "errors", "Error of the maps",
          HtmlFigure(
              DrawErrors(groups), "Map error of every run, by group",
              "A dot a run and map, joined by run. Every run also builds the two other maps from "
              "its own scans.")) +
      HtmlSection("progress", "Progress", CurvesHtml(groups)) +
      HtmlSection("runs", "Runs", RunTable(groups));
  WriteFileAtomically(out, HtmlPage(title, body));
}

}  // namespace vog
