#pragma once

#include <string>
#include <vector>

#include "tools/report/gnuplot.h"

namespace vog {

inline constexpr const char* kTruthColour = "#333333";
inline constexpr const char* kOdometryColour = "#d9730d";
inline constexpr const char* kEstimateColour = "#1b6ca8";

/// A line of a chart; an empty title keeps it out of the key.
struct Curve {
  std::string title, colour;
  std::vector<std::pair<double, double>> points;
  double line_width = 1.6;
};

/// A chart of lines from (0, 0) on.
struct Chart {
  std::string x_label, y_label;
  double max_y = 0;            ///< 0 takes what the curves need.
  std::vector<double> guides;  ///< Faint horizontal lines.
  std::vector<Curve> curves;
  int width_px = 540, height_px = 300;
};

/// @pre some curve has points.
Picture DrawChart(const Chart& chart);

bool HasPoints(const std::vector<Curve>& curves);

}  // namespace vog
