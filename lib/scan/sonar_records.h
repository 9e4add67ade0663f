#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/time.h"

namespace vog {

/// What a sonar says that finds the ranges itself.
struct SonarReturns {
  Time time;
  std::int64_t sequence = 0;
  double tilt_rad = 0;  ///< Of the servo, up positive.
  double min_range_m = 0, max_range_m = 0;
  std::vector<float> range_m;   ///< One a beam; 0 where there is no echo.
  std::vector<float> strength;  ///< One a beam, 0..1.
};

/// What an imaging sonar says: intensities, `samples[bin * beams + beam]`, from near to far.
struct SonarFrame {
  Time time;
  std::int64_t sequence = 0;
  double tilt_rad = 0;  ///< Of the servo, up positive.
  double min_range_m = 0, max_range_m = 0;
  int beams = 0, bins = 0;
  std::vector<std::uint8_t> samples;
};

}  // namespace vog
