#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lib/base/config.h"

namespace vog {

/// Log-odds of occupancy in units of 1/32, so that sums are exact whatever their order.
/// kUnknownUnits says that a voxel was never observed.
using LogOddsUnits = std::int8_t;
inline constexpr LogOddsUnits kUnknownUnits = -128;
inline constexpr float kLogOddsPerUnit = 1.0f / 32;

inline float ToLogOdds(int units) { return static_cast<float>(units) * kLogOddsPerUnit; }
/// The nearest number of units, -126 .. 126: the ends of their range stay free for marks.
inline LogOddsUnits ToUnits(double log_odds) {
  return static_cast<LogOddsUnits>(
      std::clamp(std::round(log_odds / kLogOddsPerUnit), -126.0, 126.0));
}

inline double LogOddsOfProbability(double p) { return std::log(p / (1 - p)); }
inline double ProbabilityOfLogOdds(double log_odds) { return 1 - 1 / (1 + std::exp(log_odds)); }

/// The beam's inverse sensor model and the clamping of eq. 4. Defaults: OctoMap's. Log-odds are
/// rounded to 1/32: 0.7 becomes 0.6993, 0.4 becomes 0.3998.
struct SensorModelOptions {
  double hit_probability = 0.7;
  double miss_probability = 0.4;
  double min_probability = 0.1192;
  double max_probability = 0.971;
  double occupied_probability = 0.5;

  void Visit(OptionsVisitor& v) {
    v("hit_probability", hit_probability, Between(0.51, 0.98), "of a voxel that a beam ended in");
    v("miss_probability", miss_probability, Between(0.02, 0.49), "of a voxel that a beam passed");
    v("min_probability", min_probability, Between(0.02, 0.49), "lower clamp");
    v("max_probability", max_probability, Between(0.51, 0.98), "upper clamp");
    v("occupied_probability", occupied_probability, Between(0.1, 0.9),
      "a voxel counts as occupied from here");
  }
  bool operator==(const SensorModelOptions&) const = default;
};

/// The same in units of log-odds.
struct SensorModel {
  explicit SensorModel(const SensorModelOptions& options)
      : hit(ToUnits(LogOddsOfProbability(options.hit_probability))),
        miss(ToUnits(LogOddsOfProbability(options.miss_probability))),
        min(ToUnits(LogOddsOfProbability(options.min_probability))),
        max(ToUnits(LogOddsOfProbability(options.max_probability))),
        occupied_from(ToUnits(LogOddsOfProbability(options.occupied_probability))) {}

  /// Eq. 4.
  int Clamp(int units) const { return std::clamp<int>(units, min, max); }

  LogOddsUnits hit, miss, min, max, occupied_from;
};

}  // namespace vog
