#include "lib/evaluation/consistency.h"

#include <Eigen/Cholesky>
#include <boost/math/distributions/chi_squared.hpp>

namespace vog {
namespace {

constexpr int kDimensions = 3;

}  // namespace

std::optional<Consistency> JudgeConsistency(const std::vector<PlanarError>& errors) {
  if (errors.empty()) return std::nullopt;
  const double limit = boost::math::quantile(boost::math::chi_squared(kDimensions), 0.95);
  double sum = 0;
  int below = 0;
  for (const PlanarError& error : errors) {
    const Eigen::LLT<Mat3> factor(error.covariance);
    if (factor.info() != Eigen::Success) return std::nullopt;
    const double normalised = error.error.dot(factor.solve(error.error));
    sum += normalised;
    below += normalised < limit ? 1 : 0;
  }
  const double count = static_cast<double>(errors.size());
  return Consistency{sum / (kDimensions * count), below / count};
}

}  // namespace vog
