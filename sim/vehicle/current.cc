#include "sim/vehicle/current.h"

#include <cmath>

#include "lib/base/random.h"

namespace vog {

Current::Current(const CurrentOptions& options, double step_s, std::uint64_t seed)
    : options_(options),
      seed_(seed),
      kept_(std::exp(-step_s / options.time_constant_s)),
      velocity_W_m_s_(options.mean_m_s + Draw(options.sigma_m_s)) {}

void Current::Step() {
  const Vec3 deviation = velocity_W_m_s_ - options_.mean_m_s;
  velocity_W_m_s_ = options_.mean_m_s + kept_ * deviation +
                    Draw(options_.sigma_m_s * std::sqrt(1 - kept_ * kept_));
}

Vec3 Current::Draw(double sigma_m_s) {
  return Random(seed_, "current", step_++).GaussianVector({sigma_m_s, sigma_m_s, 0});
}

}  // namespace vog
