#include "lib/base/chi_square.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/base/random.h"

namespace vog {
namespace {

TEST(ChiSquareTest, HoldsInNinetyNineOfAHundredCases) {
  Random random(1, "chi");
  constexpr int kRuns = 40000;
  for (int degrees = 1; degrees <= 6; ++degrees) {
    int below = 0;
    for (int i = 0; i < kRuns; ++i) {
      double chi_square = 0;
      for (int d = 0; d < degrees; ++d) chi_square += std::pow(random.Gaussian(1), 2);
      below += chi_square < ChiSquare99(degrees);
    }
    EXPECT_NEAR(below / static_cast<double>(kRuns), 0.99, 0.002) << degrees;
  }
}

}  // namespace
}  // namespace vog
