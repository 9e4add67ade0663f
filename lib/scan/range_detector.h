#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/base/config.h"
#include "lib/scan/scan.h"
#include "lib/scan/sonar_records.h"

namespace vog {

struct RangeDetectorOptions {
  double echo_length_m = 0.1;
  double threshold_sigma = 8;
  double usual_background = 0.023;
  double least_loudness = 2.5;
  double lone_loudness = 14;
  double supported_loudness = 25;
  double clutter_factor = 2;
  int support_beams = 3;
  double neighbour_slope_m = 0.05;
  double crossing_fraction = 0.45;
  double crosstalk_fraction = 0.48;
  double copy_fraction = 0.8;
  double copy_likeness = 0.9;
  double crosstalk_tolerance_m = 0.07;
  int crosstalk_period_beams = 8;
  int guard_beams = 5;

  void Visit(OptionsVisitor& v) {
    v("echo_length_m", echo_length_m, Between(0.01, 2),
      "an echo's energy is summed with weights that fall to 1/e over this length");
    v("threshold_sigma", threshold_sigma, Between(1, 100),
      "an echo's energy above the frame's own noise, in standard deviations of that noise");
    v("usual_background", usual_background, Between(0.001, 1),
      "mean of the background's samples that are not 0, as the sonar's usual gain gives it; the "
      "unit "
      "of loudness is halfway (geometric mean) between this and the frame's own");
    v("least_loudness", least_loudness, Between(0, 1000),
      "mean level of an echo at least, above the background");
    v("lone_loudness", lone_loudness, Between(0, 1000),
      "the same for an echo that needs no others beside it");
    v("supported_loudness", supported_loudness, Between(0, 10000),
      "the same for the sum of an echo and those beside it; less is clutter");
    v("clutter_factor", clutter_factor, Between(0, 100),
      "in clutter, supported_loudness grows by this times what is beside places without an echo");
    v("support_beams", support_beams, Between(0, 1024),
      "beams to each side in which a surface's echoes are looked for");
    v("neighbour_slope_m", neighbour_slope_m, Between(0, 10),
      "difference of a surface's range from one beam to the next, at most");
    v("crossing_fraction", crossing_fraction, Between(0.05, 1),
      "the range is where the echo first crosses this share of its peak");
    v("crosstalk_fraction", crosstalk_fraction, Between(0, 1),
      "an echo weaker than this share of one at the same range, a whole number of groups away, is "
      "taken for that one's crosstalk");
    v("copy_fraction", copy_fraction, Between(0, 1),
      "so is an echo weaker than this share of one that is shaped alike");
    v("copy_likeness", copy_likeness, Between(0, 1),
      "correlation of their samples from which echoes are shaped alike; at 1 none are");
    v("crosstalk_tolerance_m", crosstalk_tolerance_m, Between(0, 10),
      "ranges of an echo and its crosstalk differ by this, at most");
    v("crosstalk_period_beams", crosstalk_period_beams, Between(1, 1024),
      "beams that fire together are this many apart");
    v("guard_beams", guard_beams, Between(0, 1024),
      "a silent beam is sure when no beam this near has an echo");
  }
};

/// Finds each beam's first echo: *whether* there is one by its energy (a matched filter) against
/// the frame's own background, a zero-inflated exponential, and by what the beams beside it and
/// those that fire with it say at this range; *where* by the first crossing of a share of its peak.
/// `bearings_rad` has one entry a beam.
/// @pre frame.samples.size() == beams * bins.
std::vector<Beam> DetectRanges(const RangeDetectorOptions& options, const SonarFrame& frame,
                               std::span<const double> bearings_rad);

}  // namespace vog
