#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/base/config.h"
#include "lib/scan/scan.h"
#include "lib/scan/sonar_records.h"

namespace vog {

struct RangeDetectorOptions {
  double echo_length_m = 0.12;
  double threshold_sigma = 16;
  double crossing_fraction = 0.5;
  double crosstalk_fraction = 0.45;
  int crosstalk_period_beams = 8;
  int guard_beams = 5;

  void Visit(OptionsVisitor& v) {
    v("echo_length_m", echo_length_m, Between(0.01, 2), "length over which echo energy is summed");
    v("threshold_sigma", threshold_sigma, Between(1, 100),
      "an echo's energy above the frame's own noise, in standard deviations of that noise");
    v("crossing_fraction", crossing_fraction, Between(0.05, 1),
      "the range is where the echo first crosses this share of its peak");
    v("crosstalk_fraction", crosstalk_fraction, Between(0, 1),
      "an echo weaker than this share of one at the same range, a whole number of groups away, is "
      "taken for that one's crosstalk");
    v("crosstalk_period_beams", crosstalk_period_beams, Between(1, 1024),
      "beams that fire together are this many apart");
    v("guard_beams", guard_beams, Between(0, 1024),
      "a silent beam is sure when no beam this near has an echo");
  }
};

/// Finds each beam's first echo: *whether* there is one by its energy against the frame's own
/// noise, *where* by the first crossing of a share of its peak. `bearings_rad` has one entry a
/// beam.
/// @pre frame.samples.size() == beams * bins.
std::vector<Beam> DetectRanges(const RangeDetectorOptions& options, const SonarFrame& frame,
                               std::span<const double> bearings_rad);

}  // namespace vog
