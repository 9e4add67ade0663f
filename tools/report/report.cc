#include "tools/report/report.h"

#include <functional>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/parallel.h"
#include "tools/report/html.h"
#include "tools/report/key_figures.h"
#include "tools/report/pictures.h"

namespace vog {
namespace {

/// The metrics or, of a run that was not judged, what is known of it all the same.
nlohmann::ordered_json KnownMetrics(const RunFolder& run) {
  if (!run.metrics.is_null()) return run.metrics;
  return {{"submaps", run.map.submaps.size()},
          {"loop_closures",
           {{"full", run.CountEdges(graph_edge_t::FULL_CLOSURE)},
            {"partial", run.CountEdges(graph_edge_t::PARTIAL_CLOSURE)},
            {"rejected", run.CountEdges(graph_edge_t::REJECTED_CLOSURE)}}}};
}

/// A table a group; the two short last ones stand in one column.
std::string KeyFiguresHtml(const RunFolder& run) {
  const bool is_judged = !run.metrics.is_null();
  const nlohmann::ordered_json metrics = KnownMetrics(run);
  std::vector<std::pair<std::string, std::vector<std::vector<std::string>>>> groups;
  for (const KeyFigure& figure : KeyFigures()) {
    const auto value = ValueOf(figure, metrics, run.timing);
    if (!is_judged && !value) continue;
    if (groups.empty() || groups.back().first != figure.group)
      groups.push_back({figure.group, {{figure.group, ""}}});
    groups.back().second.push_back({figure.label, ShowValue(figure, value)});
  }
  std::vector<std::string> columns;
  for (const auto& [name, rows] : groups) {
    const std::string table = HtmlTable(rows);
    if (name == groups.back().first && !columns.empty()) {
      columns.back() = "<div>\n" + columns.back() + table + "</div>\n";
    } else {
      columns.push_back(table);
    }
  }
  return (is_judged ? "" : HtmlMissing("The run has no truth to be judged by.")) + HtmlRow(columns);
}

std::string LeadHtml(const RunFolder& run) {
  std::string text;
  const std::string planner = TextAt(run.metrics, "/planner");
  const std::string end_reason = TextAt(run.metrics, "/end_reason");
  if (!planner.empty()) text += "Planner " + planner + ". ";
  if (!end_reason.empty()) text += "Ended: " + end_reason + ". ";
  if (const auto unseen = NumberAt(run.metrics, "/unseen_voxels/all"); unseen.value_or(0) > 0)
    text += "Left unseen beside free water: " + ToText(*unseen) + " voxels, " +
            ToText(NumberAt(run.metrics, "/unseen_voxels/looked_at_in_vain").value_or(0)) +
            " of them looked at in vain; the others no place within reach shows well. ";
  if (!run.program_version.empty()) text += "Vogmap " + run.program_version + ".";
  return "<p class=\"lead\">" + EscapeHtml(text) + "</p>\n";
}

std::string ParametersHtml(const RunFolder& run) {
  return "<details>\n<summary>What the run was started with; everything else had its default."
         "</summary>\n<pre>" +
         EscapeHtml(run.config_toml) + "</pre>\n</details>\n";
}

std::string ReproduceHtml(const RunFolder& run) {
  const std::string live = run.live_speed ? " --live --speed " + ToText(*run.live_speed) : "";
  const std::string simulated =
      "<p>With the parameters above in a file <code>mission.toml</code>:</p>\n<pre>" +
      EscapeHtml("vog mission mission.toml --mode " + run.mode + " --seed " +
                 std::to_string(run.seed) + live + " --out again") +
      "</pre>\n";
  const std::string replayed =
      "<p>Or from the folder's own log, which gives the same map:</p>\n<pre>vog replay lcm.log "
      "--out again</pre>\n";
  return (run.metrics.is_null() ? "" : simulated) + replayed;
}

}  // namespace

void WriteReport(const std::filesystem::path& folder) {
  WriteReport(folder, folder / "report.html");
}

void WriteReport(const std::filesystem::path& folder, const std::filesystem::path& out) {
  const RunFolder run = ReadRunFolder(folder);
  const std::string title = run.Title();
  // Each draws for itself, by programs of its own.
  const std::vector<std::function<std::string()>> drawn = {
      [&] { return ReconstructionHtml(folder, run.map.voxel_size_m); },
      [&] { return PathsHtml(run); },
      [&] { return ProgressHtml(run); },
      [&] { return OccupancyHtml(run); },
      [&] { return PoseGraphHtml(run); },
      [&] { return LoopClosuresHtml(run); },
      [&] { return ConsistencyHtml(run); },
      [&] { return TimingHtml(run); }};
  std::vector<std::string> html(drawn.size());
  ParallelFor(drawn.size(), [&](std::size_t i) { html[i] = drawn[i](); });
  const std::string body =
      "<h1>" + EscapeHtml(title) + "</h1>\n" + LeadHtml(run) +
      HtmlSection("figures", "Key figures", KeyFiguresHtml(run)) +
      HtmlSection("reconstruction", "Reconstruction", html[0]) +
      HtmlSection("paths", "Paths", html[1]) + HtmlSection("progress", "Progress", html[2]) +
      HtmlSection("occupancy", "Occupancy", html[3]) + HtmlSection("graph", "Pose graph", html[4]) +
      HtmlSection("closures", "Loop closures", html[5]) +
      HtmlSection("consistency", "Consistency", html[6]) +
      HtmlSection("timing", "Planning time", html[7]) +
      HtmlSection("parameters", "Parameters", ParametersHtml(run)) +
      HtmlSection("reproduce", "The same again", ReproduceHtml(run));
  WriteFileAtomically(out, HtmlPage(title, body));
}

}  // namespace vog
