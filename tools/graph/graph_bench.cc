#include "tools/graph/graph_bench.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "lib/evaluation/statistics.h"
#include "tools/graph/resolve_trial.h"
#include "tools/mission/progress_bar.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

Json RowOf(double share, const std::vector<OutlierResult>& results) {
  int wrong = 0, wrong_kept = 0, missed = 0;
  double least_right_kept = 1;
  std::vector<double> right_kept, max_m, rmse_m, seconds;
  for (const OutlierResult& result : results) {
    wrong += result.wrong;
    wrong_kept += result.wrong_kept;
    missed += result.wrong_kept > 0;
    right_kept.push_back(static_cast<double>(result.right_kept) / result.right);
    least_right_kept = std::min(least_right_kept, right_kept.back());
    max_m.push_back(result.max_m);
    rmse_m.push_back(result.rmse_m);
    seconds.push_back(result.seconds);
  }
  return {{"share", share},
          {"wrong", wrong},
          {"wrong_kept", wrong_kept},
          {"seeds_with_wrong_kept", missed},
          {"right_kept", SpreadOf(right_kept)->mean},
          {"least_right_kept", least_right_kept},
          {"rmse_m", SpreadOf(rmse_m)->mean},
          {"max_m", SpreadOf(max_m)->mean},
          {"worst_max_m", *std::max_element(max_m.begin(), max_m.end())},
          {"seconds", SpreadOf(seconds)->mean}};
}

Json MeasureOutliers(const PoseGraph& graph, const GraphBenchOptions& options, ProgressBar& bar) {
  const auto seeds = options.last_seed - options.first_seed + 1;
  std::vector<std::vector<OutlierResult>> results(options.shares.size());
  for (std::int64_t seed = options.first_seed; seed <= options.last_seed; ++seed) {
    const OutlierTrial trial(graph, options.outliers, static_cast<std::uint64_t>(seed));
    for (std::size_t i = 0; i < options.shares.size(); ++i) {
      const double within = static_cast<double>(i) / static_cast<double>(options.shares.size());
      bar.Show(
          (static_cast<double>(seed - options.first_seed) + within) / static_cast<double>(seeds),
          "wrong closures, seed " + std::to_string(seed));
      results[i].push_back(trial.Run(options.shares[i]));
    }
  }
  Json rows = Json::array();
  for (std::size_t i = 0; i < options.shares.size(); ++i)
    rows.push_back(RowOf(options.shares[i], results[i]));
  return rows;
}

Json ToJson(const ResolveResult& result) {
  return {
      {"closures", result.closures}, {"median_ms", result.median_ms},
      {"p95_ms", result.p95_ms},     {"worst_ms", result.worst_ms},
      {"batch_ms", result.batch_ms}, {"largest_cost_difference", result.largest_cost_difference}};
}

void PrintTables(const Json& report) {
  std::printf("robust solves with wrong closures: with %s closures, seeds %s, groups of %s\n",
              report["closures"].dump().c_str(),
              report["seeds"].get_ref<const std::string&>().c_str(),
              report["group"].dump().c_str());
  std::printf("%6s %7s %7s %6s %8s %8s %8s %8s %8s %6s\n", "wrong", "wrong", "kept", "seeds",
              "right", "least", "rmse", "max", "worst", "solve");
  std::printf("%6s %7s %7s %6s %8s %8s %8s %8s %8s %6s\n", "share", "", "", "", "kept", "", "m",
              "m", "m", "s");
  for (const Json& row : report["outliers"])
    std::printf("%5.0f%% %7d %7d %6d %7.1f%% %7.1f%% %8.4f %8.4f %8.4f %6.2f\n",
                100 * row["share"].get<double>(), row["wrong"].get<int>(),
                row["wrong_kept"].get<int>(), row["seeds_with_wrong_kept"].get<int>(),
                100 * row["right_kept"].get<double>(), 100 * row["least_right_kept"].get<double>(),
                row["rmse_m"].get<double>(), row["max_m"].get<double>(),
                row["worst_max_m"].get<double>(), row["seconds"].get<double>());
  const Json& resolve = report["resolve"];
  std::printf(
      "a solve after a new closure, of %d: median %.1f ms, 95 %% %.1f ms, worst %.1f ms; a batch "
      "solve from there %.1f ms; costs differ by %.1g at most\n",
      resolve["closures"].get<int>(), resolve["median_ms"].get<double>(),
      resolve["p95_ms"].get<double>(), resolve["worst_ms"].get<double>(),
      resolve["batch_ms"].get<double>(), resolve["largest_cost_difference"].get<double>());
}

}  // namespace

void BenchGraph(const PoseGraph& graph, const GraphBenchOptions& options) {
  Json report = {
      {"nodes", graph.nodes().size()},
      {"closures", options.outliers.closures},
      {"group", options.outliers.group},
      {"shift_m", options.outliers.shift_m},
      {"seeds", std::to_string(options.first_seed) + ".." + std::to_string(options.last_seed)}};
  {
    ProgressBar bar;
    report["outliers"] = MeasureOutliers(graph, options, bar);
    bar.Show(1, "solves after new closures");
    report["resolve"] = ToJson(MeasureResolve(graph, options.resolved));
  }
  if (options.json) {
    std::printf("%s\n", report.dump(2).c_str());
  } else {
    PrintTables(report);
  }
}

}  // namespace vog
