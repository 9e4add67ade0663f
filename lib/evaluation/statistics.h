#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace vog {

struct Interval {
  double low = 0, high = 0;
};

/// Mean and spread of a sample.
struct Spread {
  int count = 0;
  double mean = 0;
  /// Of the sample, with n - 1; nothing for one value, as the next.
  std::optional<double> standard_deviation;
  /// Where the mean of all that could have been drawn lies with 95 % confidence, by Student's t.
  std::optional<Interval> interval_95;
};

/// Nothing for an empty sample.
std::optional<Spread> SpreadOf(const std::vector<double>& sample);

/// The ratio of two samples' means.
struct Ratio {
  double value = 0;
  /// 95 % of the ratios of 9,999 samples drawn with replacement from the pairs; nothing for one.
  std::optional<Interval> interval_95;
};

/// The mean of `numerators` over that of `denominators`. Equal places belong together, and are
/// drawn together; the same `seed` draws the same. Nothing without pairs or where a denominator is
/// not positive. @pre equal sizes.
std::optional<Ratio> RatioOfMeans(const std::vector<double>& numerators,
                                  const std::vector<double>& denominators, std::uint64_t seed);

/// Two-sided p-value of Wilcoxon's signed rank test: how often differences whose signs are a coin's
/// would lie as much to one side. Exact, also with ties: all signs are counted. Differences of 0
/// are left out; 1 when none is left. Time and memory grow as n^3 and n^2.
double WilcoxonSignedRankP(const std::vector<double>& differences);

}  // namespace vog
