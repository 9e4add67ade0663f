#include "tools/report/curves.h"

#include <algorithm>

namespace vog {
namespace {

/// The largest x and y.
std::pair<double, double> Extent(const std::vector<Curve>& curves) {
  std::pair<double, double> extent{0, 0};
  for (const Curve& curve : curves)
    for (const auto& [x, y] : curve.points)
      extent = {std::max(extent.first, x), std::max(extent.second, y)};
  return extent;
}

}  // namespace

bool HasPoints(const std::vector<Curve>& curves) {
  return std::any_of(curves.begin(), curves.end(),
                     [](const Curve& curve) { return !curve.points.empty(); });
}

Picture DrawChart(const Chart& chart) {
  const auto [max_x, needed_y] = Extent(chart.curves);
  const double max_y = chart.max_y > 0 ? chart.max_y : 1.05 * needed_y;
  Plot plot;
  plot.width_px = chart.width_px;
  plot.height_px = chart.height_px;
  plot.commands = "set xlabel " + PlotText(chart.x_label) + "\nset ylabel " +
                  PlotText(chart.y_label) +
                  " offset 1,0\nset xrange [0:" + PlotNumber(max_x > 0 ? max_x : 1, 9) +
                  "]\nset yrange [0:" + PlotNumber(max_y > 0 ? max_y : 1, 9) +
                  "]\nset border 3\nset key outside top center horizontal samplen 2\n"
                  "set grid ytics lc rgb '#e1e5e9' lw 0.7\n";
  for (const double guide : chart.guides)
    plot.commands += "set arrow from graph 0,first " + PlotNumber(guide) + " to graph 1,first " +
                     PlotNumber(guide) + " nohead lc rgb '#8c959f' lw 1 dt (4,4)\n";
  plot.commands += "plot ";
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Curve& curve = chart.curves[i];
    const std::string file = "curve" + std::to_string(i);
    for (const auto& [x, y] : curve.points) plot.data[file] += DataLine({x, y});
    if (curve.points.empty()) continue;
    plot.commands += PlotText(file) + " with lines lw " + PlotNumber(curve.line_width) +
                     " lc rgb '" + curve.colour + "' " +
                     (curve.title.empty() ? "notitle" : "title " + PlotText(curve.title)) + ", ";
  }
  return DrawPlot(plot);
}

}  // namespace vog
