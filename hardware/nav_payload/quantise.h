#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

namespace vog {

/// `value` in whole `step`s, held within what `Integer` can say. A signed type's lowest value stays
/// free: instruments say "unknown" with it. @pre value is finite.
template <std::integral Integer>
Integer Quantise(double value, double step = 1) {
  using Limits = std::numeric_limits<Integer>;
  const double lowest = static_cast<double>(Limits::min()) + (Limits::is_signed ? 1 : 0);
  return static_cast<Integer>(
      std::clamp(std::round(value / step), lowest, static_cast<double>(Limits::max())));
}

}  // namespace vog
