#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <string_view>

namespace vog {

/// A stream of random numbers named by (seed, stream, step). Each sensor takes a stream of its own
/// and one step per sample, so that what one sensor draws never shifts what another draws, and two
/// runs with one seed stay comparable when they differ in anything else.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view stream, std::uint64_t step = 0);

  /// Uniform in [lo, hi).
  double Uniform(double lo, double hi);
  /// Normal with mean 0 and the given standard deviation.
  double Gaussian(double sigma);
  Eigen::Vector3d GaussianVector(const Eigen::Vector3d& sigma);
  /// True with `probability`.
  bool Chance(double probability);
  /// Uniform in {0, ..., count - 1}. @pre count > 0.
  int Index(int count);

 private:
  // SplitMix64 (Steele, Lea, Flood 2014): 64 bits of state are cheap to seed for each step.
  struct Engine {
    using result_type = std::uint64_t;
    std::uint64_t state;
    static constexpr result_type min() { return 0; }
    static constexpr result_type max() { return ~result_type{0}; }
    result_type operator()();
  };

  Engine engine_;
};

}  // namespace vog
