#include "lib/evaluation/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>

#include "lib/base/random.h"

namespace vog {
namespace {

constexpr int kResamples = 9999;  // So that 2.5 % and 97.5 % are the 250th and the 9750th.

double SumOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double ResampledRatio(const std::vector<double>& numerators,
                      const std::vector<double>& denominators, Random& random) {
  double numerator = 0, denominator = 0;
  for (std::size_t draw = 0; draw < numerators.size(); ++draw) {
    const auto i = static_cast<std::size_t>(random.Index(static_cast<int>(numerators.size())));
    numerator += numerators[i];
    denominator += denominators[i];
  }
  return numerator / denominator;
}

Interval BootstrapInterval(const std::vector<double>& numerators,
                           const std::vector<double>& denominators, std::uint64_t seed) {
  std::vector<double> ratios;
  for (std::uint64_t n = 0; n < kResamples; ++n) {
    Random random(seed, "bootstrap", n);
    ratios.push_back(ResampledRatio(numerators, denominators, random));
  }
  std::sort(ratios.begin(), ratios.end());
  return {ratios[(kResamples + 1) / 40 - 1], ratios[(kResamples + 1) * 39 / 40 - 1]};
}

/// Twice the ranks of the sizes of `values`, so that the mean ranks of ties are whole numbers.
std::vector<std::size_t> DoubledRanks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size()), ranks(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto size_of = [&](std::size_t i) { return std::abs(values[i]); };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return size_of(a) < size_of(b); });
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && size_of(order[end]) == size_of(order[begin])) ++end;
    for (std::size_t i = begin; i < end; ++i) ranks[order[i]] = begin + 1 + end;
  }
  return ranks;
}

/// The probability of each sum of those ranks that a coin picks.
std::vector<double> SumsOfPicked(const std::vector<std::size_t>& ranks) {
  std::vector<double> probability = {1};
  for (const std::size_t rank : ranks) {
    std::vector<double> next(probability.size() + rank);
    for (std::size_t sum = 0; sum < probability.size(); ++sum) {
      next[sum] += 0.5 * probability[sum];
      next[sum + rank] += 0.5 * probability[sum];
    }
    probability = std::move(next);
  }
  return probability;
}

}  // namespace

std::optional<Spread> SpreadOf(const std::vector<double>& sample) {
  if (sample.empty()) return std::nullopt;
  const double count = static_cast<double>(sample.size());
  Spread spread{static_cast<int>(sample.size()), SumOf(sample) / count, {}, {}};
  if (sample.size() == 1) return spread;
  double squares = 0;
  for (const double value : sample) squares += (value - spread.mean) * (value - spread.mean);
  spread.standard_deviation = std::sqrt(squares / (count - 1));
  const double t = boost::math::quantile(boost::math::students_t(count - 1), 0.975);
  const double half = t * *spread.standard_deviation / std::sqrt(count);
  spread.interval_95 = Interval{spread.mean - half, spread.mean + half};
  return spread;
}

std::optional<Ratio> RatioOfMeans(const std::vector<double>& numerators,
                                  const std::vector<double>& denominators, std::uint64_t seed) {
  if (numerators.empty() || *std::min_element(denominators.begin(), denominators.end()) <= 0)
    return std::nullopt;
  Ratio ratio{SumOf(numerators) / SumOf(denominators), {}};
  if (numerators.size() > 1) ratio.interval_95 = BootstrapInterval(numerators, denominators, seed);
  return ratio;
}

double WilcoxonSignedRankP(const std::vector<double>& differences) {
  std::vector<double> signed_sizes;
  for (const double difference : differences)
    if (difference != 0) signed_sizes.push_back(difference);
  const std::vector<std::size_t> ranks = DoubledRanks(signed_sizes);
  std::size_t positive = 0, all = 0;
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    all += ranks[i];
    positive += signed_sizes[i] > 0 ? ranks[i] : 0;
  }
  const std::vector<double> probability = SumsOfPicked(ranks);
  const auto last = static_cast<std::ptrdiff_t>(std::min(positive, all - positive));
  return std::min(1.0,
                  2 * std::accumulate(probability.begin(), probability.begin() + last + 1, 0.0));
}

}  // namespace vog
