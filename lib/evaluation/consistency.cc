#include "lib/evaluation/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <numeric>

namespace vog {
namespace {

constexpr int kDimensions = 3;

/// What a chi-square variable stays below with a probability.
double ChiSquareQuantile(double probability) {
  return boost::math::quantile(boost::math::chi_squared(kDimensions), probability);
}

}  // namespace

std::optional<std::vector<double>> NeesPerDimension(const std::vector<PlanarError>& errors) {
  std::vector<double> nees;
  for (const PlanarError& error : errors) {
    const Eigen::LLT<Mat3> factor(error.covariance);
    if (factor.info() != Eigen::Success) return std::nullopt;
    nees.push_back(error.error.dot(factor.solve(error.error)) / kDimensions);
  }
  return nees;
}

Interval NeesBand95() {
  return {ChiSquareQuantile(0.025) / kDimensions, ChiSquareQuantile(0.975) / kDimensions};
}

std::optional<Consistency> JudgeConsistency(const std::vector<PlanarError>& errors) {
  const auto nees = NeesPerDimension(errors);
  if (!nees || nees->empty()) return std::nullopt;
  const double limit = ChiSquareQuantile(0.95) / kDimensions;
  const double count = static_cast<double>(nees->size());
  const auto below = std::count_if(nees->begin(), nees->end(),
                                   [&](double normalised) { return normalised < limit; });
  return Consistency{std::accumulate(nees->begin(), nees->end(), 0.0) / count,
                     static_cast<double>(below) / count};
}

}  // namespace vog
