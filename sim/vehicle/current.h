#pragma once

#include <cstdint>

#include "sim/vehicle/vehicle_options.h"

namespace vog {

/// The current over time, in steps of one length.
class Current {
 public:
  /// Starts with a draw from the stationary distribution.
  Current(const CurrentOptions& options, double step_s, std::uint64_t seed);

  /// In W; the same wherever the vehicle is.
  const Vec3& velocity_W_m_s() const { return velocity_W_m_s_; }

  void Step();

 private:
  Vec3 Draw(double sigma_m_s);

  CurrentOptions options_;
  std::uint64_t seed_;
  std::uint64_t step_ = 0;
  double kept_;  // Share of a deviation that is left after a step.
  Vec3 velocity_W_m_s_;
};

}  // namespace vog
