#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace vog {

/// A number of metrics.json or timing.json as the reports show it.
struct KeyFigure {
  std::string group, label;
  std::string pointer;  ///< Into the metrics, or behind "timing" into the timing.
  std::string unit;
  int decimals = 0;
  double scale = 1;  ///< From the file's unit to the shown one.
};

/// In the order of the page.
const std::vector<KeyFigure>& KeyFigures();

/// The value in the shown unit, nothing where the run has none.
std::optional<double> ValueOf(const KeyFigure& figure, const nlohmann::ordered_json& metrics,
                              const nlohmann::ordered_json& timing);

/// "0.052" for three decimals.
std::string Fixed(double value, int decimals);

/// "0.052 m"; a dash for nothing.
std::string ShowValue(const KeyFigure& figure, std::optional<double> value);

/// Decimals of a mean: counts have fractions in theirs.
int MeanDecimals(const KeyFigure& figure);

/// The mean and the sample's standard deviation, "0.052 ± 0.003"; "(2 of 3)" behind it where some
/// runs have no value.
std::string ShowSpread(const KeyFigure& figure, const std::vector<std::optional<double>>& values);

}  // namespace vog
