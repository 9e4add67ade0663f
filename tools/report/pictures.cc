#include "tools/report/pictures.h"

#include <algorithm>
#include <map>

#include "lib/evaluation/consistency.h"
#include "lib/geometry/odometry.h"
#include "tools/report/curves.h"
#include "tools/report/html.h"
#include "tools/report/key_figures.h"
#include "tools/report/view.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kHalfWidth_px = 540;
constexpr std::size_t kMaxPathPoints = 1500;
constexpr const char* kFullColour = "#1a8a45";
constexpr const char* kPartialColour = "#40b0489c";
constexpr const char* kNotJudged = "There is no time series: the run has no truth to be judged by.";

/// `x y z` lines of a trajectory, thinned evenly; an empty one where nothing is known of the way,
/// as between two flights.
std::string PathData(const Trajectory& path) {
  const std::size_t step = path.size() / kMaxPathPoints + 1;
  std::string text;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0 && path[i].time - path[i - 1].time > OdometryHistory::kLongestGap) text += "\n";
    if (i % step != 0 && i + 1 != path.size()) continue;
    const Vec3& p = path[i].X_WB.translation();
    text += DataLine({p.x(), p.y(), p.z()});
  }
  return text;
}

/// All that the pictures of the whole place must show, with a little room around it.
Eigen::AlignedBox3d PlaceBounds(const RunFolder& run) {
  Eigen::AlignedBox3d bounds;
  for (const Trajectory* path : {&run.truth, &run.odometry, &run.estimate})
    for (const TimedPose& pose : *path) bounds.extend(pose.X_WB.translation());
  for (const auto& [id, X_WM] : run.map.X_WM) bounds.extend(X_WM.translation());
  if (run.scene_W) bounds.extend(run.scene_W->Bounds());
  if (run.exploration_box_W) bounds.extend(*run.exploration_box_W);
  if (bounds.isEmpty()) bounds.extend(Vec3::Zero());
  const double room_m = std::max(0.03 * bounds.sizes().maxCoeff(), 0.3);
  return {bounds.min() - Vec3::Constant(room_m), bounds.max() + Vec3::Constant(room_m)};
}

/// A view of the place with the scene's shadow and the exploration box; `plot` parts follow.
Plot StartPlace(const RunFolder& run, const View& view) {
  Plot plot = StartView(view, PlaceBounds(run), kHalfWidth_px, PictureFormat::kPng);
  if (run.exploration_box_W) plot.commands += BoxCommand(view, *run.exploration_box_W);
  plot.commands +=
      ShadowCommands() +
      "set tics front\nset key outside top center horizontal samplen 2 maxrows 1\nplot ";
  if (!run.scene_W) return plot;
  plot.data["scene"] = MeshShadow(*run.scene_W, view);
  if (!plot.data["scene"].empty()) plot.commands += ShadowPlot("scene") + ", ";
  return plot;
}

std::string Columns(const View& view) {
  return std::to_string(view.right + 1) + ":" + std::to_string(view.up + 1);
}

void AddPath(const Trajectory& path, const View& view, const std::string& title,
             const std::string& colour, Plot& plot) {
  if (path.empty()) return;
  plot.data[title] = PathData(path);
  plot.commands += PlotText(title) + " using " + Columns(view) + " with lines lw 1.4 lc rgb '" +
                   colour + "' title " + PlotText(title) + ", ";
}

Picture DrawPaths(const RunFolder& run, const View& view) {
  Plot plot = StartPlace(run, view);
  AddPath(run.truth, view, "truth", kTruthColour, plot);
  AddPath(run.odometry, view, "odometry", kOdometryColour, plot);
  AddPath(run.estimate, view, "estimate", kEstimateColour, plot);
  const Trajectory& first = run.truth.empty() ? run.estimate : run.truth;
  if (!first.empty()) {
    plot.data["start"] = PathData({first.front()});
    plot.commands += "'start' using " + Columns(view) +
                     " with points pt 7 ps 0.8 lc rgb '#222222' title 'start'";
  }
  return DrawPlot(plot);
}

/// The points of a series of timeseries.json.
Curve SeriesCurve(const Json& series, const std::string& key, const std::string& title,
                  const std::string& colour, double scale = 1) {
  Curve curve{title, colour, SeriesPoints(series, key)};
  for (auto& point : curve.points) point.second *= scale;
  return curve;
}

/// Nothing without a time series.
std::string CoverageFigure(const RunFolder& run) {
  Chart chart{"vehicle time [s]", "seen [%]", 100, {90, 95}, {}};
  chart.curves = {SeriesCurve(run.series, "surface", "surface", "#1a8a45", 100),
                  SeriesCurve(run.series, "volume", "volume", "#1b6ca8", 100)};
  if (!HasPoints(chart.curves)) return "";
  return HtmlFigure(DrawChart(chart), "Coverage of surface and volume over time",
                    "Coverage: the share of the reachable surface and volume that the sonar has "
                    "truly seen. Dashed: 90 % and 95 %.");
}

std::string PositionErrorFigure(const RunFolder& run) {
  Chart chart{"vehicle time [s]", "position error [m]", 0, {}, {}};
  chart.curves = {SeriesCurve(run.series, "odometry_error_m", "odometry", kOdometryColour),
                  SeriesCurve(run.series, "estimate_error_m", "estimate", kEstimateColour)};
  if (!HasPoints(chart.curves)) return "";
  return HtmlFigure(DrawChart(chart), "Position error of odometry and estimate over time",
                    "Position error: distance from the true position. The estimate is the final "
                    "one, after all closures.");
}

/// A dot a submap, on a scale of powers of ten, over the band of what is right.
Picture DrawNees(const std::vector<std::pair<double, double>>& nees, double mean) {
  constexpr double kLeast = 1e-2;  // A perfect pose has no place on this scale.
  const Interval band = NeesBand95();
  Plot plot;
  plot.width_px = kHalfWidth_px;
  double max_s = 1, max_nees = 10;
  for (const auto& [time_s, value] : nees) {
    plot.data["submaps"] += DataLine({time_s, std::max(value, kLeast)});
    max_s = std::max(max_s, time_s);
    max_nees = std::max(max_nees, value);
  }
  plot.commands =
      "set xlabel 'vehicle time [s]'\nset ylabel 'normalised error squared' offset 1,0\n"
      "set border 3\nset key outside top center horizontal samplen 2\nset logscale y\n"
      "set xrange [0:" +
      PlotNumber(max_s, 9) + "]\nset yrange [" + PlotNumber(kLeast) + ":" +
      PlotNumber(2 * max_nees) + "]\nset object rectangle from graph 0,first " +
      PlotNumber(band.low) + " to graph 1,first " + PlotNumber(band.high) +
      " behind fs solid noborder fc rgb '#e4eef6'\n"
      "plot 'submaps' with points pt 7 ps 0.45 lc rgb '#1b6ca8' title 'a submap', 1 with lines lw "
      "1 "
      "dt (4,4) lc rgb '#57606a' title 'expected', " +
      PlotNumber(mean) + " with lines lw 1.4 lc rgb '#d9730d' title 'mean'";
  return DrawPlot(plot);
}

Picture DrawPlanning(const std::vector<PlanningStep>& steps) {
  Plot plot;
  plot.width_px = kHalfWidth_px;
  double max_submaps = 1, max_ms = 1e-3;
  for (const PlanningStep& step : steps) {
    plot.data["steps"] += DataLine({step.submaps, step.wall_ms});
    max_submaps = std::max(max_submaps, step.submaps);
    max_ms = std::max(max_ms, step.wall_ms);
  }
  for (const auto& [submaps, wall_ms] : MedianSteps(steps))
    plot.data["medians"] += DataLine({submaps, wall_ms});
  plot.commands =
      "set xlabel 'submaps'\nset ylabel 'planning step [ms]' offset 1,0\nset border 3\n"
      "set key outside top center horizontal\nset xrange [-0.5:" +
      PlotNumber(max_submaps + 0.5) + "]\nset yrange [0:" + PlotNumber(1.05 * max_ms) +
      "]\nset grid ytics lc rgb '#e1e5e9' lw 0.7\n"
      "plot 'steps' with points pt 7 ps 0.3 lc rgb '#7fa8c9' title 'a step', "
      "'medians' with lines lw 1.8 lc rgb '#1b6ca8' title 'median'";
  return DrawPlot(plot);
}

std::string NodeTimes(const Json& timing) {
  if (!timing.contains("node_wall_s") || !timing["node_wall_s"].is_object()) return "";
  std::vector<std::vector<std::string>> rows = {{"Process", "wall time [s]"}};
  for (const auto& [name, value] : timing["node_wall_s"].items()) {
    if (value.is_number()) rows.push_back({name, PlotNumber(value.get<double>(), 3)});
  }
  return rows.size() > 1 ? HtmlTable(rows) : "";
}

/// `x y z dx dy dz` lines of the edges of a kind.
std::string EdgeData(const RunFolder& run, std::int8_t kind) {
  std::string text;
  for (const graph_edge_t& edge : run.edges) {
    const auto from = run.map.X_WM.find(edge.from_id), to = run.map.X_WM.find(edge.to_id);
    if (edge.kind != kind || from == run.map.X_WM.end() || to == run.map.X_WM.end()) continue;
    const Vec3 p = from->second.translation(), d = to->second.translation() - p;
    text += DataLine({p.x(), p.y(), p.z(), d.x(), d.y(), d.z()});
  }
  return text;
}

void AddEdges(const RunFolder& run, std::int8_t kind, const std::string& title,
              const std::string& style, Plot& plot) {
  const std::string data = EdgeData(run, kind);
  if (data.empty()) return;
  plot.data[title] = data;
  plot.commands += PlotText(title) + " using 1:2:4:5 with vectors nohead " + style + " title " +
                   PlotText(title) + ", ";
}

Picture DrawGraph(const RunFolder& run) {
  Plot plot = StartPlace(run, kTopView);
  AddEdges(run, graph_edge_t::ODOMETRY, "odometry", "lw 1.2 lc rgb '#8c959f'", plot);
  AddEdges(run, graph_edge_t::PARTIAL_CLOSURE, "partial",
           std::string("lw 0.9 lc rgb '") + kPartialColour + "'", plot);
  AddEdges(run, graph_edge_t::FULL_CLOSURE, "full",
           std::string("lw 1.8 lc rgb '") + kFullColour + "'", plot);
  for (const auto& [id, X_WM] : run.map.X_WM) {
    const Vec3& p = X_WM.translation();
    plot.data["nodes"] += DataLine({p.x(), p.y()});
  }
  plot.commands += "'nodes' with points pt 7 ps 0.45 lc rgb '#1b6ca8' title 'submap'";
  return DrawPlot(plot);
}

/// How often each reason for a rejection was given, numbers in it left aside.
std::string RejectionTable(const RunFolder& run) {
  std::map<std::string, int> count;
  for (const graph_edge_t& edge : run.edges) {
    if (edge.kind == graph_edge_t::REJECTED_CLOSURE)
      ++count[edge.reason.empty() ? "(none)" : edge.reason];
  }
  if (count.empty()) return "";
  std::vector<std::pair<std::string, int>> sorted(count.begin(), count.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<std::vector<std::string>> rows = {{"Closures rejected because of", "number"}};
  for (const auto& [reason, number] : sorted) rows.push_back({reason, std::to_string(number)});
  return HtmlTable(rows);
}

}  // namespace

std::vector<std::pair<double, double>> SeriesPoints(const Json& series, const std::string& key) {
  std::vector<std::pair<double, double>> points;
  if (!series.is_object() || !series.contains(key) || !series[key].is_array()) return points;
  for (const Json& point : series[key]) {
    if (point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number())
      points.emplace_back(point[0].get<double>(), point[1].get<double>());
  }
  return points;
}

std::vector<PlanningStep> PlanningSteps(const Json& timing) {
  std::vector<PlanningStep> steps;
  if (!timing.is_object() || !timing.contains("planning")) return steps;
  for (const Json& step : timing["planning"]) {
    const auto submaps = NumberAt(step, "/submaps"), wall_s = NumberAt(step, "/wall_s");
    if (submaps && wall_s) steps.push_back({*submaps, 1e3 * *wall_s});
  }
  return steps;
}

std::vector<std::pair<double, double>> MedianSteps(const std::vector<PlanningStep>& steps) {
  std::map<double, std::vector<double>> by_submaps;
  for (const PlanningStep& step : steps) by_submaps[step.submaps].push_back(step.wall_ms);
  std::vector<std::pair<double, double>> medians;
  for (auto& [submaps, times] : by_submaps) {
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    medians.emplace_back(submaps, *middle);
  }
  return medians;
}

std::string PathsHtml(const RunFolder& run) {
  if (run.truth.empty() && run.odometry.empty() && run.estimate.empty())
    return HtmlMissing("The run has no trajectories.");
  std::string note;
  if (run.truth.empty())
    note = HtmlMissing("There is no truth; odometry and estimate are what was said on the way.");
  return note +
         HtmlRow(
             {HtmlFigure(DrawPaths(run, kTopView),
                         "The vehicle's true, dead-reckoned and estimated paths from above",
                         std::string("From above. ") + (run.scene_W ? "Grey: the scene. " : "") +
                             (run.exploration_box_W ? "Dashed: the exploration box." : "")),
              HtmlFigure(DrawPaths(run, kSideView),
                         "The vehicle's true, dead-reckoned and estimated paths from the side",
                         "From the side, looking along +y.")});
}

std::string ProgressHtml(const RunFolder& run) {
  const std::string html = CoverageFigure(run) + PositionErrorFigure(run);
  return html.empty() ? HtmlMissing(kNotJudged) : HtmlRow({html});
}

std::string ConsistencyHtml(const RunFolder& run) {
  const auto nees = SeriesPoints(run.series, "nees_per_dimension");
  const auto mean = NumberAt(run.metrics, "/nees_per_dimension");
  const auto share = NumberAt(run.metrics, "/nees_share_below_95");
  if (nees.empty() || !mean || !share)
    return HtmlMissing("There is no truth, or too little of a map, to judge the covariances by.");
  const Interval band = NeesBand95();
  const std::string caption =
      "The error of each submap's pose relative to the first one, x, y and yaw, in standard "
      "deviations "
      "that the pose graph gives it: squared, a dimension. Where the covariances hold, 95 of 100 "
      "lie in "
      "the band, " +
      Fixed(band.low, 2) + " to " + Fixed(band.high, 2) + ", with a mean of 1. Here the mean is " +
      Fixed(*mean, 2) + ", and " + Fixed(100 * *share, 0) +
      " % of the submaps lie below their one-sided limit. The submaps of one run share most of "
      "their errors: a campaign tells more.";
  return HtmlRow({HtmlFigure(DrawNees(nees, *mean),
                             "Normalised error squared of each submap over time", caption)});
}

std::string TimingHtml(const RunFolder& run) {
  const std::vector<PlanningStep> steps = PlanningSteps(run.timing);
  const std::string picture =
      steps.empty()
          ? HtmlMissing("No times of planning steps: they are taken in lock-step runs only.")
          : HtmlFigure(DrawPlanning(steps),
                       "Wall time of planning steps over the number of submaps",
                       "Wall time of each planning step over the submaps in the map.");
  return HtmlRow({picture, NodeTimes(run.timing)});
}

std::string PoseGraphHtml(const RunFolder& run) {
  if (run.map.X_WM.empty()) return HtmlMissing("The map has no submaps.");
  const auto count = [&](std::int8_t kind) { return std::to_string(run.CountEdges(kind)); };
  const std::string caption =
      "From above, at the final poses: " + std::to_string(run.map.X_WM.size()) + " submaps, " +
      count(graph_edge_t::FULL_CLOSURE) + " full and " + count(graph_edge_t::PARTIAL_CLOSURE) +
      " partial loop closures; " + count(graph_edge_t::REJECTED_CLOSURE) + " rejected.";
  return HtmlRow({HtmlFigure(DrawGraph(run), "The pose graph from above", caption),
                  run.edges.empty() ? HtmlMissing("The log tells no edges of the graph.")
                                    : RejectionTable(run)});
}

}  // namespace vog
