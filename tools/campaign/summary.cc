#include "tools/campaign/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/evaluation/statistics.h"
#include "tools/campaign/campaign_report.h"
#include "tools/launch/child_process.h"
#include "tools/report/key_figures.h"
#include "tools/report/run_folder.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

constexpr std::uint64_t kBootstrapSeed = 1;
// What differs by less is equal, and differs by rounding.
constexpr double kLeastDifference = 1e-9;

// Two numbers of each mission whose means are divided.
struct RatioFigure {
  const char *name, *label, *numerator, *denominator;
};
constexpr std::array<RatioFigure, 2> kRatios = {{
    {"rmse_m_vog_to_vog_no_lc", "RMSE with closures : without", "/rmse_m/vog", "/rmse_m/vog_no_lc"},
    {"rmse_m_vog_to_standard", "RMSE with closures : standard map", "/rmse_m/vog",
     "/rmse_m/standard"},
}};

// Two numbers of each mission, with closures and without, that are compared seed by seed.
struct PairFigure {
  const char *name, *label, *with, *without;
};
constexpr std::array<PairFigure, 2> kPairs = {{
    {"rmse_m", "RMSE", "/rmse_m/vog", "/rmse_m/vog_no_lc"},
    {"position_error_m", "Position error", "/position_error_m/estimate/mean",
     "/position_error_m/odometry/mean"},
}};

/// The figures of metrics.json; those of timing.json are the machine's.
std::vector<KeyFigure> FiguresOfMetrics() {
  std::vector<KeyFigure> figures = KeyFigures();
  std::erase_if(figures, [](const KeyFigure& figure) { return !figure.pointer.starts_with("/"); });
  return figures;
}

// --- statistics ---

/// The numbers of missions that have all of `pointers`, a list for each pointer.
template <std::size_t N>
std::array<std::vector<double>, N> NumbersOf(const CaseResults& results,
                                             const std::array<const char*, N>& pointers,
                                             std::vector<std::int64_t>* seeds = nullptr) {
  std::array<std::vector<double>, N> numbers;
  for (const MissionResult& mission : results.missions) {
    std::array<std::optional<double>, N> values;
    for (std::size_t i = 0; i < N; ++i) values[i] = NumberAt(mission.metrics, pointers[i]);
    if (std::any_of(values.begin(), values.end(), [](const auto& value) { return !value; }))
      continue;
    for (std::size_t i = 0; i < N; ++i) numbers[i].push_back(*values[i]);
    if (seeds != nullptr) seeds->push_back(mission.seed);
  }
  return numbers;
}

Json ToJson(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json ToJson(const std::optional<Interval>& interval) {
  return interval ? Json{interval->low, interval->high} : Json(nullptr);
}

Json ToJson(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"n", spread->count},
          {"mean", spread->mean},
          {"standard_deviation", ToJson(spread->standard_deviation)},
          {"interval_95", ToJson(spread->interval_95)}};
}

Json ToJson(const std::optional<Ratio>& ratio) {
  if (!ratio) return nullptr;
  return {{"value", ratio->value}, {"interval_95", ToJson(ratio->interval_95)}};
}

Json CompareOf(const PairFigure& figure, const CaseResults& results) {
  std::vector<std::int64_t> seeds;
  const auto [with, without] = NumbersOf<2>(results, {figure.with, figure.without}, &seeds);
  std::vector<double> differences;
  Json worse = Json::array();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const double difference = with[i] - without[i];
    differences.push_back(std::abs(difference) < kLeastDifference ? 0 : difference);
    if (differences.back() > 0) worse.push_back(seeds[i]);
  }
  return {{"difference", ToJson(SpreadOf(differences))},
          {"wilcoxon_p", WilcoxonSignedRankP(differences)},
          {"worse", worse.size()},
          {"worse_seeds", worse}};
}

Json FailuresOf(const CaseResults& results) {
  Json failures = Json::array();
  for (const MissionResult& mission : results.missions)
    if (mission.metrics.is_null())
      failures.push_back({{"seed", mission.seed}, {"error", mission.error}});
  return failures;
}

// --- results ---

/// The last words of a mission that has no result, the same wherever the campaign's folder is.
std::string ErrorOf(const CampaignFolder& folder, const MissionId& mission) {
  const std::filesystem::path output = folder.OutputOf(mission);
  if (!std::filesystem::exists(output)) return "not flown";
  std::string error = LastLine(output);
  if (error.empty()) return "broke off";
  const std::string own = folder.path().string() + "/";
  for (std::size_t at = error.find(own); at != std::string::npos; at = error.find(own))
    error.erase(at, own.size());
  if (const std::size_t at = error.find(".part-"); at != std::string::npos) {
    const std::size_t job = error.find('-', at);
    error.erase(job, error.find('/', job) - job);
  }
  const std::string program = "vog: ";
  return error.starts_with(program) ? error.substr(program.size()) : error;
}

MissionResult ReadResult(const CampaignFolder& folder, const MissionId& mission) {
  if (!folder.IsFinished(mission)) return {mission.seed, nullptr, ErrorOf(folder, mission)};
  return {mission.seed, ReadRunNumbers(folder.ResultOf(mission)).metrics, ""};
}

// --- table ---

using Row = std::vector<std::string>;

/// Characters of a UTF-8 text.
std::size_t WidthOf(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

std::string Aligned(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], WidthOf(row[c]));
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c)
      line += row[c] + std::string(widths[c] - WidthOf(row[c]) + 3, ' ');
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string ShowInterval(const Json& interval, int decimals, double scale = 1) {
  if (!interval.is_array()) return "";
  return " [" + Fixed(scale * interval[0].get<double>(), decimals) + ", " +
         Fixed(scale * interval[1].get<double>(), decimals) + "]";
}

std::string ShowMean(const Json& spread, int decimals, double scale = 1) {
  if (!spread.is_object()) return "–";
  std::string text = Fixed(scale * spread["mean"].get<double>(), decimals);
  if (spread["standard_deviation"].is_number())
    text += " ± " + Fixed(scale * spread["standard_deviation"].get<double>(), decimals);
  return text + ShowInterval(spread["interval_95"], decimals, scale);
}

std::string ShowRatio(const Json& ratio) {
  if (!ratio.is_object()) return "–";
  return Fixed(ratio["value"].get<double>(), 3) + ShowInterval(ratio["interval_95"], 3);
}

std::string ShowProbability(const Json& p) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.2g", p.get<double>());
  return text.data();
}

std::string ShowWorse(const Json& pair) {
  std::string text = std::to_string(pair["worse"].get<int>());
  if (!pair["worse_seeds"].empty()) text += ": seeds";
  for (const Json& seed : pair["worse_seeds"]) text += " " + seed.dump();
  return text;
}

std::string CaseName(const Json& one) { return one["name"].get<std::string>(); }

/// How many missions of a case have a result.
std::string ShowFlown(const Json& one) {
  const std::size_t all = one["missions"].get<std::size_t>();
  return std::to_string(all - one["failed"].size()) + " of " + std::to_string(all);
}

/// A row of the table: what is shown of each case.
template <class Show>
Row RowOf(const std::string& label, const Json& cases, Show show) {
  Row row = {label};
  for (const Json& one : cases) row.push_back(show(one));
  return row;
}

}  // namespace

std::vector<CaseResults> ReadResults(const CampaignFolder& folder, const Campaign& campaign) {
  std::vector<CaseResults> all;
  for (const CampaignCase& one : campaign.cases) {
    CaseResults results{one.name, {}};
    for (const MissionId& mission : campaign.Missions())
      if (mission.case_folder == one.folder)
        results.missions.push_back(ReadResult(folder, mission));
    all.push_back(std::move(results));
  }
  return all;
}

Json SummaryOf(const CaseResults& results) {
  const Json failures = FailuresOf(results);
  Json summary = {
      {"name", results.name}, {"missions", results.missions.size()}, {"failed", failures}};
  for (const KeyFigure& figure : FiguresOfMetrics())
    summary["figures"][Pointer(figure.pointer)] =
        ToJson(SpreadOf(NumbersOf<1>(results, {figure.pointer.c_str()})[0]));
  for (const RatioFigure& figure : kRatios) {
    const auto [numerators, denominators] =
        NumbersOf<2>(results, {figure.numerator, figure.denominator});
    summary["ratios"][figure.name] = ToJson(RatioOfMeans(numerators, denominators, kBootstrapSeed));
  }
  for (const PairFigure& figure : kPairs)
    summary["closures_against_none"][figure.name] = CompareOf(figure, results);
  return summary;
}

Json SummaryOf(const Campaign& campaign, const std::vector<CaseResults>& results) {
  Json summary = {{"name", campaign.name},
                  {"program_version", VOG_VERSION},
                  {"seeds", {{"first", campaign.seeds.first}, {"last", campaign.seeds.last}}},
                  {"cases", Json::array()}};
  for (const CaseResults& one : results) summary["cases"].push_back(SummaryOf(one));
  return summary;
}

std::vector<Row> RowsOf(const Json& summary) {
  const Json& cases = summary["cases"];
  std::vector<Row> rows = {RowOf("", cases, CaseName), RowOf("Missions", cases, ShowFlown)};
  for (const KeyFigure& figure : FiguresOfMetrics())
    rows.push_back(RowOf(figure.label + (figure.unit.empty() ? "" : " [" + figure.unit + "]"),
                         cases, [&](const Json& one) {
                           return ShowMean(one["figures"][Pointer(figure.pointer)],
                                           MeanDecimals(figure), figure.scale);
                         }));
  for (const RatioFigure& figure : kRatios)
    rows.push_back(RowOf(figure.label, cases,
                         [&](const Json& one) { return ShowRatio(one["ratios"][figure.name]); }));
  for (const PairFigure& figure : kPairs) {
    const auto pair = [&](const Json& one) { return one["closures_against_none"][figure.name]; };
    const std::string label = figure.label;
    rows.push_back(RowOf(label + ", closures less none [m]", cases,
                         [&](const Json& one) { return ShowMean(pair(one)["difference"], 3); }));
    rows.push_back(RowOf(label + ", Wilcoxon's p", cases, [&](const Json& one) {
      return ShowProbability(pair(one)["wilcoxon_p"]);
    }));
    rows.push_back(RowOf(label + ", worse with closures", cases,
                         [&](const Json& one) { return ShowWorse(pair(one)); }));
  }
  return rows;
}

std::vector<Row> MapErrorRowsOf(const Json& summary) {
  std::vector<Row> rows = {
      {"RMSE [m]", "missions", "with closures", "without closures", "standard global map"}};
  for (const Json& one : summary["cases"]) {
    const Json& rmse_m = one["figures"]["rmse_m"];
    rows.push_back({CaseName(one), ShowFlown(one), ShowMean(rmse_m["vog"], 3),
                    ShowMean(rmse_m["vog_no_lc"], 3), ShowMean(rmse_m["standard"], 3)});
  }
  return rows;
}

std::vector<Row> ClosureGainRowsOf(const Json& summary) {
  std::vector<Row> rows = {{"RMSE with closures", ": without", ": standard map", "less without [m]",
                            "Wilcoxon's p", "worse than without"}};
  for (const Json& one : summary["cases"]) {
    const Json& pair = one["closures_against_none"]["rmse_m"];
    rows.push_back({CaseName(one), ShowRatio(one["ratios"]["rmse_m_vog_to_vog_no_lc"]),
                    ShowRatio(one["ratios"]["rmse_m_vog_to_standard"]),
                    ShowMean(pair["difference"], 3), ShowProbability(pair["wilcoxon_p"]),
                    ShowWorse(pair)});
  }
  return rows;
}

std::string TableOf(const Json& summary) {
  std::string text =
      summary["name"].get<std::string>() + ", seeds " + summary["seeds"]["first"].dump() + " to " +
      summary["seeds"]["last"].dump() + ", vog " + summary["program_version"].get<std::string>() +
      "\nmean ± standard deviation [95 % confidence interval of the mean or ratio]\n\n" +
      Aligned(RowsOf(summary));
  for (const Json& one : summary["cases"])
    for (const Json& failure : one["failed"])
      text += "\nfailed: " + CaseName(one) + ", seed " + failure["seed"].dump() + ": " +
              failure["error"].get<std::string>() + "\n";
  return text;
}

Json WriteTables(const CampaignFolder& folder, const Campaign& campaign) {
  const std::vector<CaseResults> results = ReadResults(folder, campaign);
  Json summary = SummaryOf(campaign, results);
  WriteFileAtomically(folder.path() / "campaign.json", summary.dump(2) + "\n");
  WriteFileAtomically(folder.path() / "campaign.txt", TableOf(summary));
  WriteCampaignReport(folder, campaign, results, summary);
  return summary;
}

}  // namespace vog
