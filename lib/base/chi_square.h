#pragma once

#include <array>
#include <cstddef>

namespace vog {

/// The value that a chi-square variable with `degrees` (1..6) degrees of freedom stays below in 99
/// % of all cases.
inline double ChiSquare99(int degrees) {
  constexpr std::array<double, 7> kLimit = {0, 6.635, 9.210, 11.345, 13.277, 15.086, 16.812};
  return kLimit.at(static_cast<std::size_t>(degrees));
}

}  // namespace vog
