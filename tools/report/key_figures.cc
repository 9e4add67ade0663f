#include "tools/report/key_figures.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "tools/report/run_folder.h"

namespace vog {
namespace {

constexpr const char* kTiming = "timing";

}  // namespace

std::string Fixed(double value, int decimals) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

const std::vector<KeyFigure>& KeyFigures() {
  static const std::vector<KeyFigure> figures = {
      {"Map", "RMSE, VOG-map with closures", "/rmse_m/vog", "m", 3},
      {"Map", "RMSE, VOG-map without closures", "/rmse_m/vog_no_lc", "m", 3},
      {"Map", "RMSE, standard global map", "/rmse_m/standard", "m", 3},
      {"Map", "RMSE of points, estimate", "/rmse_points_m/estimate", "m", 3},
      {"Map", "RMSE of points, odometry", "/rmse_points_m/odometry", "m", 3},
      {"Map", "Point error, estimate", "/point_error_m/estimate", "m", 3},
      {"Map", "Point error, odometry", "/point_error_m/odometry", "m", 3},
      {"Vehicle", "Position error, estimate, mean", "/position_error_m/estimate/mean", "m", 3},
      {"Vehicle", "Position error, estimate, end", "/position_error_m/estimate/end", "m", 3},
      {"Vehicle", "Position error, odometry, mean", "/position_error_m/odometry/mean", "m", 3},
      {"Vehicle", "Position error, odometry, end", "/position_error_m/odometry/end", "m", 3},
      {"Vehicle", "Position error inside submaps, mean", "/position_error_m/within_submaps/mean",
       "m", 3},
      {"Vehicle", "Path length", "/path_length_m", "m", 1},
      {"Vehicle", "Collisions", "/collisions", "", 0},
      {"Vehicle", "Smallest clearance", "/min_clearance_m", "m", 3},
      {"Vehicle", "Time of the smallest clearance", "/min_clearance_time_s", "s", 1},
      {"Vehicle", "Normalised error squared a dimension", "/nees_per_dimension", "", 2},
      {"Vehicle", "Submaps below its 95 % limit", "/nees_share_below_95", "%", 0, 100},
      {"Exploration", "Surface seen", "/coverage/surface", "%", 1, 100},
      {"Exploration", "Volume seen", "/coverage/volume", "%", 1, 100},
      {"Exploration", "Time to 90 % of the surface", "/time_to_s/surface_90", "s", 0},
      {"Exploration", "Time to 95 % of the volume", "/time_to_s/volume_95", "s", 0},
      {"Exploration", "Submaps", "/submaps", "", 0},
      {"Exploration", "Scans", "/scans", "", 0},
      {"Loop closures", "Closures, full", "/loop_closures/full", "", 0},
      {"Loop closures", "Closures, partial", "/loop_closures/partial", "", 0},
      {"Loop closures", "Closures, rejected", "/loop_closures/rejected", "", 0},
      {"Time", "Vehicle time", "/vehicle_time_s", "s", 1},
      {"Time", "Wall time", "timing/wall_s", "s", 1},
  };
  return figures;
}

std::optional<double> ValueOf(const KeyFigure& figure, const nlohmann::ordered_json& metrics,
                              const nlohmann::ordered_json& timing) {
  const bool is_timing = figure.pointer.starts_with(kTiming);
  const auto value = is_timing
                         ? NumberAt(timing, figure.pointer.substr(std::string_view(kTiming).size()))
                         : NumberAt(metrics, figure.pointer);
  if (!value) return std::nullopt;
  return figure.scale * *value;
}

std::string ShowValue(const KeyFigure& figure, std::optional<double> value) {
  if (!value) return "–";
  return Fixed(*value, figure.decimals) + (figure.unit.empty() ? "" : " " + figure.unit);
}

int MeanDecimals(const KeyFigure& figure) {
  return figure.decimals == 0 && figure.unit.empty() ? 1 : figure.decimals;
}

std::string ShowSpread(const KeyFigure& figure, const std::vector<std::optional<double>>& values) {
  double sum = 0;
  int count = 0;
  for (const auto& value : values) {
    if (!value) continue;
    sum += *value;
    ++count;
  }
  if (count == 0) return "–";
  const double mean = sum / count;
  double squares = 0;
  for (const auto& value : values) {
    if (value) squares += (*value - mean) * (*value - mean);
  }
  const int decimals = MeanDecimals(figure);
  std::string text = Fixed(mean, decimals);
  if (count > 1) text += " ± " + Fixed(std::sqrt(squares / (count - 1)), decimals);
  if (count < static_cast<int>(values.size()))
    text += " (" + std::to_string(count) + " of " + std::to_string(values.size()) + ")";
  return text;
}

}  // namespace vog
