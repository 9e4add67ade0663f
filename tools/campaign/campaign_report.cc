#include "tools/campaign/campaign_report.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "lib/base/files.h"
#include "lib/base/log.h"
#include "tools/report/curves.h"
#include "tools/report/html.h"
#include "tools/report/key_figures.h"
#include "tools/report/map_errors.h"
#include "tools/report/pictures.h"
#include "tools/report/run_folder.h"
#include "tools/report/settings.h"

namespace vog {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kReport = "campaign.html";
constexpr const char* kUnknown = "–";

// --- curves over missions ---

/// A number over time, of several missions: their quartiles at times evenly apart.
class Quartiles {
 public:
  /// Up to `end_s`, where the longest of the missions ends.
  explicit Quartiles(double end_s) : end_s_(end_s), samples_(kSteps + 1) {}

  /// Points (time, value) in the order of time; the last value stays. @pre there are some.
  void Add(const std::vector<std::pair<double, double>>& points) {
    std::size_t next = 0;
    double value = 0;
    for (std::size_t step = 0; step <= kSteps; ++step) {
      for (; next < points.size() && points[next].first <= TimeAt(step); ++next)
        value = points[next].second;
      samples_[step].push_back(value);
    }
  }

  /// Lines `time low median high`, each value times `scale`.
  std::string ToData(double scale) {
    std::string text;
    for (std::size_t step = 0; step <= kSteps; ++step) {
      std::vector<double>& sample = samples_[step];
      if (sample.empty()) return "";
      std::sort(sample.begin(), sample.end());
      const auto at = [&](double share) {
        const double place = share * static_cast<double>(sample.size() - 1);
        const auto low = static_cast<std::size_t>(place);
        const std::size_t high = std::min(low + 1, sample.size() - 1);
        return std::lerp(sample[low], sample[high], place - static_cast<double>(low));
      };
      text += DataLine({TimeAt(step), scale * at(0.25), scale * at(0.5), scale * at(0.75)});
    }
    return text;
  }

 private:
  static constexpr std::size_t kSteps = 150;

  double TimeAt(std::size_t step) const {
    return end_s_ * static_cast<double>(step) / static_cast<double>(kSteps);
  }

  double end_s_;
  std::vector<std::vector<double>> samples_;
};

/// What the pictures need of a case's missions, beside their metrics.
struct CaseCurves {
  std::string name;
  std::vector<std::vector<std::pair<double, double>>> surface;
  std::vector<PlanningStep> planning;
};

CaseCurves ReadCurves(const CampaignFolder& folder, const CampaignCase& one,
                      const CaseResults& results) {
  CaseCurves curves{one.name, {}, {}};
  for (const MissionResult& mission : results.missions) {
    if (mission.metrics.is_null()) continue;
    const RunNumbers run = ReadRunNumbers(folder.ResultOf({one.folder, mission.seed}));
    const auto surface = SeriesPoints(run.series, "surface");
    if (!surface.empty()) curves.surface.push_back(surface);
    const auto steps = PlanningSteps(run.timing);
    curves.planning.insert(curves.planning.end(), steps.begin(), steps.end());
  }
  return curves;
}

std::string CoverageHtml(const std::vector<CaseCurves>& cases) {
  double end_s = 0;
  for (const CaseCurves& one : cases)
    for (const auto& points : one.surface) end_s = std::max(end_s, points.back().first);
  Plot plot;
  plot.width_px = 1100;
  plot.height_px = 340;
  plot.commands =
      "set xlabel 'vehicle time [s]'\nset ylabel 'surface seen [%]' offset 1,0\nset border 3\n"
      "set key outside top center horizontal samplen 2\nset grid ytics lc rgb '#e1e5e9' lw 0.7\n"
      "set yrange [0:100]\nset xrange [0:" +
      PlotNumber(std::max(end_s, 1.0), 9) + "]\nset style fill transparent solid 0.15 noborder\n";
  std::string bands, medians;
  for (std::size_t c = 0; c < cases.size(); ++c) {
    Quartiles quartiles(end_s);
    for (const auto& points : cases[c].surface) quartiles.Add(points);
    const std::string file = "case" + std::to_string(c), data = quartiles.ToData(100);
    if (data.empty()) continue;
    plot.data[file] = data;
    const std::string colour = std::string(" lc rgb '") + GroupColour(c) + "'";
    bands += PlotText(file) + " using 1:2:4 with filledcurves" + colour + " notitle, ";
    medians += PlotText(file) + " using 1:3 with lines lw 1.8" + colour + " title " +
               PlotText(cases[c].name) + ", ";
  }
  if (medians.empty()) return HtmlMissing("The missions have no time series.");
  plot.commands += "plot " + bands + medians;
  return HtmlFigure(DrawPlot(plot), "Surface coverage of the cases over time",
                    "The share of the reachable surface that was truly seen: the median over the "
                    "missions, and the band in which the middle half of them lies. A mission that "
                    "has ended keeps its last value.");
}

std::string PlanningHtml(const std::vector<CaseCurves>& cases) {
  Chart chart{"submaps", "planning step, median [ms]", 0, {}, {}};
  chart.width_px = 1100;
  for (std::size_t c = 0; c < cases.size(); ++c)
    chart.curves.push_back({cases[c].name, GroupColour(c), MedianSteps(cases[c].planning)});
  if (!HasPoints(chart.curves)) return HtmlMissing("The missions have no planning times.");
  return HtmlFigure(DrawChart(chart), "Median planning time of the cases over submaps",
                    "Wall time of a planning step over the submaps in the map, the median over all "
                    "steps of a case. Times are the machine's: they differ from one to another, "
                    "and with what else runs there. Nothing else on this page does.");
}

// --- errors ---

std::vector<ErrorGroup> ErrorGroupsOf(const std::vector<CaseResults>& results) {
  std::vector<ErrorGroup> groups;
  for (const CaseResults& one : results) {
    groups.push_back({one.name, {}});
    for (const MissionResult& mission : one.missions)
      if (NumberAt(mission.metrics, "/rmse_m/vog"))
        groups.back().metrics.push_back(&mission.metrics);
  }
  return groups;
}

/// The groups' names beside their colours.
std::string LegendHtml(const std::vector<ErrorGroup>& groups) {
  std::string html;
  for (std::size_t g = 0; g < groups.size(); ++g)
    html += (g > 0 ? ", " : "") + std::string("<span class=\"swatch\" style=\"background:") +
            GroupColour(g) + "\"></span> " + EscapeHtml(groups[g].name);
  return html;
}

std::string ErrorsHtml(const std::vector<CaseResults>& results) {
  const std::vector<ErrorGroup> groups = ErrorGroupsOf(results);
  if (std::all_of(groups.begin(), groups.end(),
                  [](const ErrorGroup& group) { return group.metrics.empty(); }))
    return HtmlMissing("No mission tells its maps' errors.");
  return HtmlFigure(DrawMapErrors(groups), "Map error of every mission, by case",
                    "A dot a mission and map, joined by mission. Every mission also builds the two "
                    "other maps from its own scans.") +
         HtmlFigure(DrawPairedErrors(groups),
                    "Map error with closures over that without, and over that of the standard map",
                    "A dot a mission: " + LegendHtml(groups) +
                        ". Below the dashed line the map with closures is the better of the two.");
}

// --- tables ---

std::string FailuresHtml(const Json& summary) {
  std::vector<std::vector<std::string>> rows = {{"Failed", "seed", "last words"}};
  for (const Json& one : summary["cases"])
    for (const Json& failure : one["failed"])
      rows.push_back({one["name"].get<std::string>(), failure["seed"].dump(),
                      failure["error"].get<std::string>()});
  return rows.size() > 1 ? HtmlWide(HtmlTable(rows)) : "";
}

/// A mission's numbers; its seed leads to its report where that is kept.
std::vector<std::string> MissionRow(const CampaignFolder& folder, const MissionId& id,
                                    const std::string& case_name, const Json& metrics) {
  const std::string seed = std::to_string(id.seed);
  const bool has_report = fs::is_regular_file(folder.ResultOf(id) / "report.html");
  std::vector<std::string> row = {EscapeHtml(case_name),
                                  has_report ? HtmlLink(id.text() + "/report.html", seed) : seed};
  for (const char* pointer :
       {"/submaps", "/rmse_m/vog", "/rmse_m/vog_no_lc", "/rmse_m/standard",
        "/position_error_m/estimate/mean", "/nees_per_dimension", "/coverage/surface",
        "/loop_closures/full", "/loop_closures/partial", "/collisions", "/vehicle_time_s"}) {
    const auto found =
        std::find_if(KeyFigures().begin(), KeyFigures().end(),
                     [&](const KeyFigure& figure) { return figure.pointer == pointer; });
    const auto value = ValueOf(*found, metrics, Json());
    row.push_back(value ? Fixed(*value, found->decimals) : kUnknown);
  }
  row.push_back(EscapeHtml(TextAt(metrics, "/end_reason")));
  return row;
}

std::string MissionsHtml(const CampaignFolder& folder, const Campaign& campaign,
                         const std::vector<CaseResults>& results) {
  std::vector<std::vector<std::string>> rows = {
      {"Case", "seed", "submaps", "RMSE with closures [m]", "without [m]", "standard [m]",
       "position error [m]", "NEES", "surface [%]", "full", "partial", "collisions", "time [s]",
       "ended"}};
  for (std::size_t c = 0; c < results.size(); ++c)
    for (const MissionResult& mission : results[c].missions)
      if (!mission.metrics.is_null())
        rows.push_back(MissionRow(folder, {campaign.cases[c].folder, mission.seed}, results[c].name,
                                  mission.metrics));
  return rows.size() > 1 ? HtmlWide(HtmlTableOfHtml(rows))
                         : HtmlMissing("No mission has a result.");
}

// --- settings ---

/// A row a setting that is not the same in all cases.
std::string DifferencesHtml(const Campaign& campaign) {
  std::vector<std::map<std::string, std::string>> settings;
  std::set<std::string> names;
  std::vector<std::vector<std::string>> rows = {{"Setting"}};
  for (const CampaignCase& one : campaign.cases) {
    settings.push_back(SettingsOf(one.mission.ToToml()));
    for (const auto& [name, value] : settings.back()) names.insert(name);
    rows[0].push_back(one.name);
  }
  for (const std::string& name : names) {
    std::vector<std::string> row = {name};
    for (const auto& own : settings) row.push_back(own.count(name) ? own.at(name) : "default");
    if (std::adjacent_find(row.begin() + 1, row.end(), std::not_equal_to<>()) != row.end())
      rows.push_back(std::move(row));
  }
  if (rows.size() == 1) return HtmlMissing("The cases have the same settings.");
  return HtmlWide(HtmlTable(rows));
}

std::string SettingsHtml(const Campaign& campaign) {
  std::string html = DifferencesHtml(campaign);
  for (const CampaignCase& one : campaign.cases)
    html += "<details>\n<summary>" + EscapeHtml(one.name) +
            ": all that is set; everything else has its default.</summary>\n<pre>" +
            EscapeHtml(one.mission.ToToml()) + "</pre>\n</details>\n";
  return html;
}

std::string ReproduceHtml(const Campaign& campaign) {
  std::string file = "[campaign]\nname = " + Json(campaign.name).dump() + "\n";
  if (!campaign.keep.empty()) file += "keep = " + Json(campaign.keep).dump() + "\n";
  for (const CampaignCase& one : campaign.cases)
    file += "\n[[case]]\nname = " + Json(one.name).dump() +
            "\nmission = " + Json(one.folder + ".toml").dump() + "\n";
  const std::string seeds =
      std::to_string(campaign.seeds.first) + ".." + std::to_string(campaign.seeds.last);
  return "<p>With the settings above in a file a case and this <code>campaign.toml</code> beside "
         "them:</p>\n<pre>" +
         EscapeHtml(file) + "</pre>\n<pre>" +
         EscapeHtml("vog campaign campaign.toml --seeds " + seeds + " --out again") +
         "</pre>\n<p>A mission by itself:</p>\n<pre>" +
         EscapeHtml("vog mission " + campaign.cases.front().folder + ".toml --seed " +
                    std::to_string(campaign.seeds.first) + " --out again") +
         "</pre>\n";
}

std::string LeadHtml(const Campaign& campaign, const Json& summary) {
  std::size_t all = 0, failed = 0;
  for (const Json& one : summary["cases"]) {
    all += one["missions"].get<std::size_t>();
    failed += one["failed"].size();
  }
  return "<p class=\"lead\">" +
         EscapeHtml(std::to_string(all - failed) + " of " + std::to_string(all) +
                    " missions: seeds " + std::to_string(campaign.seeds.first) + " to " +
                    std::to_string(campaign.seeds.last) + " of " +
                    std::to_string(campaign.cases.size()) + " cases. " + "Vogmap " +
                    summary["program_version"].get<std::string>() + ".") +
         "</p>\n<p>Mean ± standard deviation [95 % confidence interval of the mean or "
         "ratio].</p>\n";
}

}  // namespace

std::string CampaignReport(const CampaignFolder& folder, const Campaign& campaign,
                           const std::vector<CaseResults>& results, const Json& summary) {
  std::vector<CaseCurves> curves;
  for (std::size_t c = 0; c < results.size(); ++c)
    curves.push_back(ReadCurves(folder, campaign.cases[c], results[c]));
  const std::string body =
      "<h1>" + EscapeHtml("Campaign " + campaign.name) + "</h1>\n" + LeadHtml(campaign, summary) +
      HtmlSection("maps", "Error of the maps",
                  HtmlWide(HtmlTable(MapErrorRowsOf(summary))) +
                      HtmlWide(HtmlTable(ClosureGainRowsOf(summary))) + FailuresHtml(summary)) +
      HtmlSection("errors", "Mission by mission", ErrorsHtml(results)) +
      HtmlSection("progress", "Coverage", CoverageHtml(curves)) +
      HtmlSection("timing", "Planning time", PlanningHtml(curves)) +
      HtmlSection("figures", "All figures", HtmlWide(HtmlTable(RowsOf(summary)))) +
      HtmlSection("missions", "Missions", MissionsHtml(folder, campaign, results)) +
      HtmlSection("settings", "Settings in which the cases differ", SettingsHtml(campaign)) +
      HtmlSection("reproduce", "The same again", ReproduceHtml(campaign));
  return HtmlPage("Campaign " + campaign.name, body);
}

void WriteCampaignReport(const CampaignFolder& folder, const Campaign& campaign,
                         const std::vector<CaseResults>& results, const Json& summary) {
  const fs::path file = folder.path() / kReport;
  if (HasGnuplot()) {
    WriteFileAtomically(file, CampaignReport(folder, campaign, results, summary));
    return;
  }
  fs::remove(file);  // Of an earlier call's seeds.
  LogLine(std::string(kReport) + " is not written: install the package gnuplot-nox to have it");
}

}  // namespace vog
