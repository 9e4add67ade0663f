#include "tools/report/map_errors.h"

#include <algorithm>
#include <array>

#include "tools/report/run_folder.h"

namespace vog {
namespace {

struct JudgedMap {
  const char *pointer, *title, *colour;
};
constexpr std::array<JudgedMap, 3> kMaps = {
    {{"/rmse_m/vog", "VOG-map with closures", "#0072b2"},
     {"/rmse_m/vog_no_lc", "without closures", "#e69f00"},
     {"/rmse_m/standard", "standard global map", "#cc3311"}}};
constexpr double kLeastExtent_m = 0.01;
// So many names of groups stand beside each other.
constexpr std::size_t kFlatNames = 5;

std::string MapData(std::size_t map) { return "map" + std::to_string(map); }

// --- two maps of each run ---

constexpr int kSquare_px = 300, kLeft_px = 82, kBottom_px = 56, kRoom_px = 14;

std::string PairData(std::size_t other, std::size_t group) {
  return MapData(other) + "-" + std::to_string(group);
}

/// Adds a file of `other with` lines for each other map and group; returns the largest error.
double AddPairs(const std::vector<ErrorGroup>& groups, Plot& plot) {
  double max_m = kLeastExtent_m;
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const auto* metrics : groups[g].metrics) {
      const auto with_m = NumberAt(*metrics, kMaps[0].pointer);
      for (std::size_t other = 1; other < kMaps.size(); ++other) {
        const auto other_m = NumberAt(*metrics, kMaps[other].pointer);
        if (!with_m || !other_m) continue;
        max_m = std::max({max_m, *with_m, *other_m});
        plot.data[PairData(other, g)] += DataLine({*other_m, *with_m});
      }
    }
  return max_m;
}

/// Draws a square for one of the other maps.
std::string SquareCommands(std::size_t other, std::size_t groups, const Plot& plot) {
  const auto share = [](int part, int whole) {
    return PlotNumber(static_cast<double>(part) / whole, 9);
  };
  const int left = kLeft_px + static_cast<int>(other - 1) * (kSquare_px + kLeft_px);
  std::string commands = "set lmargin at screen " + share(left, plot.width_px) +
                         "\nset rmargin at screen " + share(left + kSquare_px, plot.width_px) +
                         "\nset bmargin at screen " + share(kBottom_px, plot.height_px) +
                         "\nset tmargin at screen " +
                         share(kBottom_px + kSquare_px, plot.height_px) + "\nset xlabel " +
                         PlotText(std::string(kMaps[other].title) + " [m]") +
                         "\nset ylabel 'with closures [m]' offset 1,0\n"
                         "plot x with lines lw 1 dt (4,4) lc rgb '#57606a'";
  for (std::size_t g = 0; g < groups; ++g)
    if (plot.data.count(PairData(other, g)))
      commands += ", " + PlotText(PairData(other, g)) + " with points pt 7 ps 0.6 lc rgb '" +
                  GroupColour(g) + "'";
  return commands + "\n";
}

}  // namespace

const char* GroupColour(std::size_t group) {
  // Okabe and Ito's set without its yellow.
  constexpr std::array<const char*, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#56b4e9", "#e69f00", "#333333"};
  return kColours[group % kColours.size()];
}

Picture DrawMapErrors(const std::vector<ErrorGroup>& groups) {
  Plot plot;
  plot.width_px = 1100;
  plot.height_px = groups.size() > kFlatNames ? 380 : 300;
  std::string tics;
  double max_m = kLeastExtent_m;
  for (std::size_t m = 0; m < kMaps.size(); ++m) plot.data[MapData(m)];
  for (std::size_t g = 0; g < groups.size(); ++g) {
    tics += (g > 0 ? ", " : "") + PlotText(groups[g].name) + " " + std::to_string(g);
    for (const auto* metrics : groups[g].metrics) {
      for (std::size_t m = 0; m < kMaps.size(); ++m) {
        const auto rmse_m = NumberAt(*metrics, kMaps[m].pointer);
        if (!rmse_m) continue;
        max_m = std::max(max_m, *rmse_m);
        const double x = static_cast<double>(g) + 0.22 * (static_cast<double>(m) - 1);
        plot.data[MapData(m)] += DataLine({x, *rmse_m});
        plot.data["runs"] += DataLine({x, *rmse_m});
      }
      plot.data["runs"] += "\n";
    }
  }
  plot.commands = "set xtics (" + tics + ") scale 0" +
                  (groups.size() > kFlatNames ? " rotate by -20" : "") +
                  "\nset xrange [-0.6:" + PlotNumber(static_cast<double>(groups.size()) - 0.4) +
                  "]\nset yrange [0:" + PlotNumber(1.08 * max_m) +
                  "]\nset ylabel 'RMSE after ICP [m]' offset 1,0\nset border 3\n"
                  "set grid ytics lc rgb '#e1e5e9' lw 0.7\n"
                  "set key outside top center horizontal\n"
                  "plot 'runs' with lines lw 0.6 lc rgb '#c8ced4' notitle";
  for (std::size_t m = 0; m < kMaps.size(); ++m)
    if (!plot.data[MapData(m)].empty())
      plot.commands += ", " + PlotText(MapData(m)) + " with points pt 7 ps 0.7 lc rgb '" +
                       kMaps[m].colour + "' title " + PlotText(kMaps[m].title);
  return DrawPlot(plot);
}

Picture DrawPairedErrors(const std::vector<ErrorGroup>& groups) {
  Plot plot;
  plot.width_px = 2 * (kLeft_px + kSquare_px) + kRoom_px;
  plot.height_px = kRoom_px + kSquare_px + kBottom_px;
  const double max_m = AddPairs(groups, plot);
  const std::string range = "[0:" + PlotNumber(1.05 * max_m) + "]\n";
  plot.commands = "set xrange " + range + "set yrange " + range +
                  "unset key\nset border 3\nset grid lc rgb '#e1e5e9' lw 0.7\nset multiplot\n";
  for (std::size_t other = 1; other < kMaps.size(); ++other)
    plot.commands += SquareCommands(other, groups.size(), plot);
  plot.commands += "unset multiplot";
  return DrawPlot(plot);
}

}  // namespace vog
