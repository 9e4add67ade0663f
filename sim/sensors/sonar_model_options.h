#pragma once

#include "lib/base/config.h"

namespace vog {

/// What the simulated sonar says: ranges that it found itself, or intensities.
enum class SonarOutput { kReturns, kFrames };

/// Table [sonar_model]: what the sonar's beams are like beyond their geometry. The defaults are
/// measured on public DIDSON and HAUV recordings, but for the grazing angle, of which nothing is
/// published. Intensities are shares of full scale.
struct SonarModelOptions {
  SonarOutput emits = SonarOutput::kReturns;
  int rays_per_beam = 5;
  double range_noise_m = 0.02;
  double range_cell_m = 0.12;
  double enough_echo = 0.4;
  double grazing_limit_deg = 15;
  double grazing_exponent = 2;
  double miss_probability = 0.01;
  double false_return_probability = 0.002;
  double double_bounce_probability = 0.002;
  double crosstalk_probability = 0.004;
  int crosstalk_period_beams = 8;
  double crosstalk_min_db = 9;
  double crosstalk_max_db = 14;
  double double_bounce_db = 12;
  double echo_level = 0.3;
  double echo_length_m = 0.12;
  int frame_bins = 512;
  double background_zero_probability = 0.623;
  double background_level = 0.023;
  double background_rise = 3.3;
  double background_rise_length_m = 0.8;
  double beam_gain_spread = 3;

  void Visit(OptionsVisitor& v) {
    v("emits", emits,
      Names<SonarOutput>{{SonarOutput::kReturns, "returns"}, {SonarOutput::kFrames, "frames"}},
      "the sonar finds the ranges itself, or says intensities");
    v("rays_per_beam", rays_per_beam, Between(1, 1000),
      "rays that stand for a beam, spread over its width and thickness; the first in its middle");
    v("range_noise_m", range_noise_m, Between(0, 1), "standard deviation of a range");
    v("range_cell_m", range_cell_m, Between(0.001, 10), "echoes this close together are one");
    v("enough_echo", enough_echo, Between(0.01, 1),
      "share of a beam that must meet a surface for a sure echo; less is seen less often");
    v("grazing_limit_deg", grazing_limit_deg, Between(0, 90),
      "angle to a surface below which its echo grows weak");
    v("grazing_exponent", grazing_exponent, Between(0, 20),
      "of the weakening: the echo goes with this power of the angle's sine");
    v("miss_probability", miss_probability, Between(0, 1), "of an echo to be lost");
    v("false_return_probability", false_return_probability, Between(0, 1),
      "of a beam to meet something that is not there");
    v("double_bounce_probability", double_bounce_probability, Between(0, 1),
      "of an echo to go the way twice: returns at twice the range, frames with a ghost there");
    v("crosstalk_probability", crosstalk_probability, Between(0, 1),
      "of a beam to return the echo of one that fires with it; in frames it always shows, weakly");
    v("crosstalk_period_beams", crosstalk_period_beams, Between(1, 1024),
      "beams that fire together are this many apart");
    v("crosstalk_min_db", crosstalk_min_db, Between(0, 200),
      "how much weaker crosstalk is, at least");
    v("crosstalk_max_db", crosstalk_max_db, Between(0, 200),
      "how much weaker crosstalk is, at most");
    v("double_bounce_db", double_bounce_db, Between(0, 200), "how much weaker a ghost is");
    v("echo_level", echo_level, Between(0, 10), "mean amplitude of a full beam's echo");
    v("echo_length_m", echo_length_m, Between(0.001, 10), "an echo's length at half of its height");
    v("frame_bins", frame_bins, Between(8, 8192), "range bins of a frame");
    v("background_zero_probability", background_zero_probability, Between(0, 1),
      "of a sample without an echo to be 0, on the average");
    v("background_level", background_level, Between(0.002, 1), "mean of the others");
    v("background_rise", background_rise, Between(1, 100),
      "reverberation: background at the window's start, in that far away");
    v("background_rise_length_m", background_rise_length_m, Between(0.01, 100),
      "distance over which it falls to 1/e");
    v("beam_gain_spread", beam_gain_spread, Between(1, 100),
      "background of the loudest beam in that of the quietest");
  }

  /// @throws UsageError if crosstalk_min_db is above crosstalk_max_db.
  void Validate() const;
};

}  // namespace vog
