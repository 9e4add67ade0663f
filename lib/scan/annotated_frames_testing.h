#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lib/base/random.h"
#include "lib/scan/range_detector.h"
#include "lib/scan/sonar.h"

namespace vog {

/// What a made frame shows. The last three hold nothing that has a range worth knowing.
enum class Sight { kHull, kBlades, kWall, kGrazing, kSmallTargets, kWater, kFish, kFlotsam };

/// How made frames differ from the published statistics of real ones (DIDSON with a profiling lens,
/// window 2.25-11.25 m, 96 beams, 512 bins), which are the defaults.
struct FrameStyle {
  std::string name = "as published";
  double gain = 1;              ///< Of everything.
  double noise_gain = 1;        ///< Of the background alone.
  double clutter_gain = 1;      ///< Of fish and flotsam alone.
  double beam_gain_spread = 3;  ///< The loudest beam's gain in the quietest's.
  double echo_level = 98;       ///< Median of an echo's level, of 255; speckle's peaks are higher.
  double echo_spread = 0.38;    ///< Of its logarithm along a surface and between surfaces.
  double echo_length_m = 0.125;
  double speckle = 0.55;  ///< Share of a sample's level that fluctuates by itself.
  double crosstalk_min_db = 9, crosstalk_max_db = 14;
  bool is_logarithmic = false;  ///< Crosstalk in decibels of the scale: 255 is 90 dB.
  bool has_sharp_rise = true;   ///< Echoes rise at once and die away; otherwise they are bells.
  bool is_turned = false;       ///< Surfaces are twice as steep.
};

/// A frame and the bin of each beam's first surface, as a person would mark it; -1 for none.
struct AnnotatedFrame {
  SonarFrame frame;
  std::vector<int> range_bin;
};

/// Paints frames of one style. Frame `index` of a sight draws from Random(seed, "annotated",
/// index).
class AnnotatedFrames {
 public:
  static constexpr int kBeams = 96, kBins = 512;
  static constexpr double kMin_m = 2.25, kMax_m = 11.25, kBin_m = (kMax_m - kMin_m) / kBins;

  explicit AnnotatedFrames(FrameStyle style, std::uint64_t seed = 1)
      : style_(std::move(style)), seed_(seed) {
    for (int beam = 0; beam < kBeams; ++beam) {
      const double spread = style_.beam_gain_spread;
      gains_.push_back(
          Random(seed, "gain", beam).Uniform(2 / (1 + spread), 2 * spread / (1 + spread)));
    }
  }

  AnnotatedFrame Make(Sight sight, int index) {
    Random random(seed_, "annotated", 100 * index + static_cast<int>(sight));
    levels_.assign(kBeams * kBins, 0);
    first_.assign(kBeams, -1);
    Draw(sight, random);
    AddCrosstalk(random);
    AnnotatedFrame made{{{}, index, 0, kMin_m, kMax_m, kBeams, kBins, {}}, first_};
    for (int i = 0; i < kBeams * kBins; ++i) {
      const double level =
          levels_[i] + style_.noise_gain * Background(i / kBeams, i % kBeams, random);
      made.frame.samples.push_back(
          static_cast<std::uint8_t>(std::clamp(std::round(style_.gain * level), 0.0, 255.0)));
    }
    return made;
  }

 private:
  void Draw(Sight sight, Random& random) {
    const double middle_m = random.Uniform(3.5, 8);
    const double steepness = style_.is_turned ? 2 : 1;
    switch (sight) {
      case Sight::kHull:
        return DrawSurface(random.Index(20), 70 + random.Index(26), middle_m,
                           steepness * random.Uniform(-0.03, 0.03), 1, 1, random);
      case Sight::kBlades:
        for (int beam = random.Index(15); beam < kBeams;) {
          const int width = 8 + random.Index(18);
          DrawSurface(beam, std::min(beam + width, kBeams), middle_m + random.Uniform(-1, 1),
                      steepness * random.Uniform(-0.06, 0.06), 1, 1 + random.Uniform(1, 5), random);
          beam += width + random.Index(6) - 2;
        }
        return;
      case Sight::kWall:
        return DrawSurface(0, kBeams, middle_m, steepness * random.Uniform(-0.004, 0.004), 1, 1,
                           random);
      case Sight::kGrazing:
        return DrawSurface(random.Index(10), 75 + random.Index(20), 5,
                           steepness * random.Uniform(0.03, 0.05), 0.62, 2.5, random);
      case Sight::kSmallTargets:
        for (int i = 0; i < 4; ++i) {
          const int beam = random.Index(kBeams - 6);
          DrawSurface(beam, beam + 4 + random.Index(3), random.Uniform(3, 10), 0, 1.3, 0.4, random);
        }
        return;
      case Sight::kWater:
        return;
      case Sight::kFish:
        return DrawPoints(110 + random.Index(41), 1.2, 82, random);
      case Sight::kFlotsam:
        return DrawPoints(90 + random.Index(41), 4, 78, random);
    }
  }

  /// A surface that meanders; `strength` and `length` are of its echoes in those of clean hull.
  void DrawSurface(int from, int to, double range_m, double slope_m, double strength, double length,
                   Random& random) {
    const double surface_level = std::exp(random.Gaussian(0.7 * style_.echo_spread));
    const double wave_m = random.Uniform(0, 0.15), phase = random.Uniform(0, 6);
    double fading = 0;
    for (int beam = from; beam < to; ++beam) {
      fading = 0.8 * fading + 0.6 * random.Gaussian(0.7 * style_.echo_spread);
      const double r_m = range_m + slope_m * (beam - from) +
                         wave_m * std::sin(0.12 * beam + phase) + random.Gaussian(0.015);
      const double level = style_.echo_level * strength * surface_level * std::exp(fading);
      if (random.Chance(0.03)) continue;
      const int bin = static_cast<int>((r_m - kMin_m) / kBin_m);
      const double peak = PaintEcho(beam, r_m, level, length * style_.echo_length_m, random);
      const bool is_seen = peak >= 45 && bin >= 0 && bin < kBins;
      if (is_seen && (first_[beam] < 0 || bin < first_[beam])) first_[beam] = bin;
      if (random.Chance(0.05)) PaintEcho(beam, 2 * r_m, level / 4, style_.echo_length_m, random);
    }
  }

  /// Echoes of no surface, around one place.
  void DrawPoints(int count, double spread_m, double level, Random& random) {
    const double middle_m = random.Uniform(4, 9);
    for (int i = 0; i < count; ++i) {
      const int beam = random.Index(kBeams);
      const double r_m = middle_m + random.Uniform(-spread_m, spread_m);
      const double point_level = style_.clutter_gain * level * std::exp(random.Gaussian(0.4));
      const double length_m = random.Uniform(0.012, 0.04);
      PaintEcho(beam, r_m, point_level, length_m, random);
      if (beam + 1 < kBeams && random.Chance(0.3))
        PaintEcho(beam + 1, r_m + random.Gaussian(0.02), 0.6 * point_level, length_m, random);
    }
  }

  /// Returns the largest sample. `length_m` is between the halves of the height.
  double PaintEcho(int beam, double range_m, double level, double length_m, Random& random) {
    double peak = 0;
    const double sigma_m = length_m / (2 * std::sqrt(2 * std::numbers::ln2));
    const int from = static_cast<int>((range_m - length_m - kMin_m) / kBin_m);
    const int to = static_cast<int>((range_m + 4 * length_m - kMin_m) / kBin_m);
    for (int bin = std::max(0, from); bin < std::min(kBins, to); ++bin) {
      const double depth_m = kMin_m + (bin + 0.5) * kBin_m - range_m;
      const double rise = std::clamp(1 + depth_m / (1.5 * kBin_m), 0.0, 1.0);
      const double bell = std::exp(-0.5 * std::pow((depth_m - 0.5 * length_m) / sigma_m, 2));
      const double shape =
          style_.has_sharp_rise
              ? rise * std::exp(-std::max(0.0, depth_m - 0.4 * length_m) / (0.55 * length_m))
              : bell;
      const double speckle = 1 - style_.speckle + style_.speckle * Rayleigh(random);
      float& sample = levels_[bin * kBeams + beam];
      sample = std::max(sample, static_cast<float>(level * shape * speckle));
      peak = std::max<double>(peak, sample);
    }
    return peak;
  }

  void AddCrosstalk(Random& random) {
    const std::vector<float> echoes = levels_;
    for (int groups = 1; groups < kBeams / 8; ++groups) {
      for (const int offset : {8 * groups, -8 * groups}) {
        const double db = random.Uniform(style_.crosstalk_min_db, style_.crosstalk_max_db) +
                          std::min(groups - 1, 3) * 1.5;
        for (int i = 0; i < kBeams * kBins; ++i) {
          const int beam = i % kBeams;
          if (beam + offset < 0 || beam + offset >= kBeams || echoes[i] < 8) continue;
          const double level = style_.is_logarithmic ? echoes[i] - db * 255 / 90
                                                     : echoes[i] * std::pow(10, -db / 20);
          float& sample = levels_[i + offset];
          sample = std::max(sample, static_cast<float>(level));
        }
      }
    }
  }

  /// Zero-inflated exponential; its mean falls from 0.0186 to 0.0057 of full scale.
  double Background(int bin, int beam, Random& random) const {
    const double range_m = kMin_m + (bin + 0.5) * kBin_m;
    const double mean = 255 * (0.0057 + 0.016 * std::exp(-(range_m - kMin_m) / 1.6));
    const double chance = std::min(0.95, 0.26 * gains_[beam] * mean / (255 * 0.0057));
    if (!random.Chance(chance)) return 0;
    return -5.4 * std::log(1 - random.Uniform(0, 1)) + 0.5;
  }

  static double Rayleigh(Random& random) {
    return 2 / std::sqrt(std::numbers::pi) * std::sqrt(-std::log(1 - random.Uniform(0, 1)));
  }

  FrameStyle style_;
  std::uint64_t seed_;
  std::vector<double> gains_;
  std::vector<float> levels_;
  std::vector<int> first_;
};

/// The bin of each beam's return; -1 for none.
using Bins = std::vector<int>;

/// What DetectRanges with its defaults says.
inline Bins Detected(const SonarFrame& frame) {
  static const std::vector<double> bearings_rad = BeamBearings(SonarOptions{});
  const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
  Bins bins;
  for (const Beam& beam : DetectRanges({}, frame, bearings_rad))
    bins.push_back(beam.status == BeamStatus::kReturn
                       ? static_cast<int>((beam.range_m - frame.min_range_m) / bin_m)
                       : -1);
  return bins;
}

/// How a detector's returns agree with the marks of frames: whether a beam has one, and where.
struct Score {
  static constexpr int kNear_bins = 8;
  int returns = 0, found = 0, correct = 0, near = 0, false_in_empty = 0;
  std::vector<int> errors_bins;

  void Add(const AnnotatedFrame& made, const Bins& bins) {
    const bool is_empty = *std::max_element(made.range_bin.begin(), made.range_bin.end()) < 0;
    for (std::size_t beam = 0; beam < bins.size(); ++beam) {
      const bool is_return = made.range_bin[beam] >= 0, is_found = bins[beam] >= 0;
      returns += is_return;
      found += is_found;
      false_in_empty += is_empty && is_found;
      if (!is_return || !is_found) continue;
      ++correct;
      errors_bins.push_back(std::abs(bins[beam] - made.range_bin[beam]));
      near += errors_bins.back() <= kNear_bins;
    }
  }
  double recall() const { return static_cast<double>(correct) / std::max(1, returns); }
  /// Of returns that are found within kNear_bins.
  double near_recall() const { return static_cast<double>(near) / std::max(1, returns); }
  double precision() const { return static_cast<double>(correct) / std::max(1, found); }
  int Error90_bins() {
    if (errors_bins.empty()) return 0;
    const auto nth = errors_bins.begin() + static_cast<std::ptrdiff_t>(0.9 * errors_bins.size());
    std::nth_element(errors_bins.begin(), nth, errors_bins.end());
    return *nth;
  }
};

/// Of `rounds` sets like the published one: seven frames with returns, three without.
template <class Detector>
Score Measure(const FrameStyle& style, int rounds, const Detector& detector) {
  constexpr Sight kSights[] = {
      Sight::kHull, Sight::kHull,         Sight::kBlades, Sight::kBlades, Sight::kGrazing,
      Sight::kWall, Sight::kSmallTargets, Sight::kWater,  Sight::kFish,   Sight::kFlotsam};
  AnnotatedFrames frames(style);
  Score score;
  int index = 0;
  for (int round = 0; round < rounds; ++round) {
    for (const Sight sight : kSights) {
      const AnnotatedFrame made = frames.Make(sight, index++);
      score.Add(made, detector(made.frame));
    }
  }
  return score;
}

}  // namespace vog
