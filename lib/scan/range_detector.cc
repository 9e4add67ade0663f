#include "lib/scan/range_detector.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

/// What an echo's energy is summed with: weights that fall with the distance behind its rise.
struct Filter {
  int length_bins;
  float decay;   // From one bin to the next.
  float sum;     // Of the weights.
  float spread;  // Standard deviation of a weighted mean in that of a sample.

  Filter(const RangeDetectorOptions& options, const SonarFrame& frame) {
    const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
    const double a = std::exp(-bin_m / options.echo_length_m);
    length_bins =
        std::clamp(static_cast<int>(std::lround(options.echo_length_m / bin_m)), 1, frame.bins);
    decay = static_cast<float>(a);
    sum = static_cast<float>(1 / (1 - a));
    spread = static_cast<float>(std::sqrt((1 - a) / (1 + a)));
  }
};

/// Weighted means of the samples from each bin on, laid out as they are.
std::vector<float> MeansFrom(const SonarFrame& frame, const Filter& filter) {
  const std::size_t beams = frame.beams;
  std::vector<float> means(frame.samples.size());
  std::vector<float> sums(beams);
  for (std::size_t row = means.size(); row > 0;) {
    row -= beams;
    for (std::size_t beam = 0; beam < beams; ++beam) {
      sums[beam] = sums[beam] * filter.decay + frame.samples[row + beam];
      means[row + beam] = sums[beam] / filter.sum;
    }
  }
  return means;
}

float Quantile(std::vector<float>& values, double share) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// The background: a share of its samples is 0, the others are exponentially distributed. Its mean
/// goes with the range and the beam. Ordered statistics of cells, a beam's stretch of some bins
/// each, because echoes fill many of them.
class Background {
 public:
  static constexpr int kBlock_bins = 32;

  explicit Background(const SonarFrame& frame)
      : beams_(frame.beams), blocks_((frame.bins + kBlock_bins - 1) / kBlock_bins) {
    std::vector<float> squares;
    SumCells(frame, squares);
    EstimateSample(squares);
    EstimateLevels();
    EstimateGains();
  }

  /// Mean of the samples that are not 0.
  float sample() const { return sample_; }
  float MeanAt(int bin, int beam) const { return levels_[bin / kBlock_bins] * gains_[beam]; }
  /// Standard deviation of a sample.
  float SpreadAt(int bin, int beam) const {
    const float mean = MeanAt(bin, beam);
    return std::sqrt(std::max(mean * (2 * sample_ - mean), kLeastSpread * kLeastSpread));
  }

 private:
  static constexpr float kLeastSample = 1.5f, kLeastSpread = 1;

  void SumCells(const SonarFrame& frame, std::vector<float>& squares) {
    means_.assign(static_cast<std::size_t>(beams_) * blocks_, 0);
    squares = means_;
    for (int bin = 0; bin < frame.bins; ++bin) {
      const std::uint8_t* const row = frame.samples.data() + std::size_t(bin) * beams_;
      float* const mean = &means_[std::size_t(bin / kBlock_bins) * beams_];
      float* const square = &squares[std::size_t(bin / kBlock_bins) * beams_];
      for (int beam = 0; beam < beams_; ++beam) {
        const float sample = row[beam];
        mean[beam] += sample;
        square[beam] += sample * sample;
      }
    }
    for (std::size_t i = 0; i < means_.size(); ++i) {
      const int block = static_cast<int>(i) / beams_;
      const int size = std::min(kBlock_bins, frame.bins - block * kBlock_bins);
      means_[i] /= static_cast<float>(size);
      squares[i] /= static_cast<float>(size);
    }
  }
  /// An exponential's mean square is twice the square of its mean, and zeros lessen the mean square
  /// as they lessen the mean.
  void EstimateSample(std::vector<float>& squares) {
    std::vector<float> means = means_;
    const float mean = Quantile(means, 0.5);
    sample_ = mean > 0 ? std::max(kLeastSample, Quantile(squares, 0.5) / (2 * mean)) : kLeastSample;
  }
  void EstimateLevels() {
    constexpr int kNear_blocks = 2;
    std::vector<float> cells;
    for (int block = 0; block < blocks_; ++block) {
      const int from = std::max(0, block - kNear_blocks);
      const int to = std::min(blocks_, block + kNear_blocks + 1);
      cells.assign(means_.begin() + std::ptrdiff_t(from) * beams_,
                   means_.begin() + std::ptrdiff_t(to) * beams_);
      levels_.push_back(Quantile(cells, 0.4));
    }
  }
  void EstimateGains() {
    constexpr float kLeastGain = 0.25f, kMostGain = 4;
    std::vector<float> ratios(blocks_);
    for (int beam = 0; beam < beams_; ++beam) {
      for (int block = 0; block < blocks_; ++block) {
        const float level = levels_[block];
        ratios[block] = level > 0 ? means_[std::size_t(block) * beams_ + beam] / level : 1;
      }
      gains_.push_back(std::clamp(Quantile(ratios, 0.5), kLeastGain, kMostGain));
    }
  }

  int beams_, blocks_;
  std::vector<float> means_;  // Of each cell, block by block.
  float sample_ = 0;
  std::vector<float> levels_;  // Of each block.
  std::vector<float> gains_;   // Of each beam.
};

/// Something that stands out of the background.
struct Echo {
  int bin = 0;         // Where it first crosses a share of its peak.
  int rise_bin = 0;    // From where on there is most energy.
  float peak = 0;      // Its strongest sample's excess over the background, 0..1.
  float loudness = 0;  // Its mean excess, in units of EchoFinder.
};
/// Of one beam, from near to far.
using Echoes = std::vector<Echo>;

/// Finds what stands out in one beam after the other.
class EchoFinder {
 public:
  EchoFinder(const RangeDetectorOptions& options, const SonarFrame& frame)
      : options_(options),
        frame_(frame),
        filter_(options, frame),
        background_(frame),
        unit_(static_cast<float>(std::sqrt(background_.sample() * 255 * options.usual_background))),
        means_(MeansFrom(frame, filter_)),
        thresholds_(Thresholds()) {}

  Echoes Find(int beam) const {
    Echoes echoes;
    for (int bin = 0; bin < frame_.bins; ++bin) {
      if (means_[At(bin, beam)] < thresholds_[At(bin / Background::kBlock_bins, beam)]) continue;
      const Echo echo = EchoFrom(bin, beam);
      echoes.push_back(echo);
      bin = echo.rise_bin + filter_.length_bins;
    }
    return echoes;
  }

 private:
  std::size_t At(int bin, int beam) const { return std::size_t(bin) * frame_.beams + beam; }
  float LoudnessAt(int bin, int beam) const {
    return (means_[At(bin, beam)] - background_.MeanAt(bin, beam)) / unit_;
  }
  /// The least weighted mean of each of the background's cells that stands out.
  std::vector<float> Thresholds() const {
    std::vector<float> thresholds;
    for (int bin = 0; bin < frame_.bins; bin += Background::kBlock_bins) {
      for (int beam = 0; beam < frame_.beams; ++beam) {
        const double noise = filter_.spread * background_.SpreadAt(bin, beam);
        const double least =
            std::max(options_.threshold_sigma * noise, options_.least_loudness * unit_);
        thresholds.push_back(background_.MeanAt(bin, beam) + static_cast<float>(least));
      }
    }
    return thresholds;
  }
  float ExcessAt(int bin, int beam) const {
    return (frame_.samples[At(bin, beam)] - background_.MeanAt(bin, beam)) / 255;
  }

  /// The echo whose energy is felt at `bin`. It is loudest where it rises.
  Echo EchoFrom(int bin, int beam) const {
    Echo echo{bin, bin, 0, 0};
    for (int i = bin + 1; i < std::min(frame_.bins, echo.rise_bin + filter_.length_bins); ++i) {
      if (means_[At(i, beam)] > means_[At(echo.rise_bin, beam)]) echo.rise_bin = i;
    }
    echo.loudness = LoudnessAt(echo.rise_bin, beam);
    int peak_bin = echo.rise_bin;
    for (int i = bin; i < std::min(frame_.bins, echo.rise_bin + filter_.length_bins); ++i) {
      if (ExcessAt(i, beam) > echo.peak) {
        peak_bin = i;
        echo.peak = ExcessAt(i, beam);
      }
    }
    echo.bin = std::max(bin, echo.rise_bin - filter_.length_bins);
    while (echo.bin < peak_bin && ExcessAt(echo.bin, beam) < options_.crossing_fraction * echo.peak)
      ++echo.bin;
    return echo;
  }

  const RangeDetectorOptions& options_;
  const SonarFrame& frame_;
  Filter filter_;
  Background background_;
  // Of loudness. The frame's own background tells the sonar's gain, but not alone: quiet water is
  // no reason to believe weak echoes.
  float unit_;
  std::vector<float> means_;       // Laid out as the samples.
  std::vector<float> thresholds_;  // Of each cell.
};

/// Judges echoes by those of other beams.
class EchoJudge {
 public:
  EchoJudge(const RangeDetectorOptions& options, const SonarFrame& frame,
            const std::vector<Echoes>& beams)
      : options_(options), frame_(frame), beams_(beams) {
    const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
    length_bins_ = Filter(options, frame).length_bins;
    slope_bins_ = options.neighbour_slope_m / bin_m;
    same_bins_ = std::max(1, static_cast<int>(std::lround(options.crosstalk_tolerance_m / bin_m)));
    clutter_ = MeasureClutter(bin_m);
  }

  /// The first echo that is neither crosstalk nor clutter; nullptr if there is none.
  const Echo* FirstReturn(int beam) const {
    for (const Echo& echo : beams_[beam]) {
      if (IsSurface(echo, beam) && !IsCrosstalk(echo, beam)) return &echo;
    }
    return nullptr;
  }

 private:
  int count() const { return static_cast<int>(beams_.size()); }

  /// The loudest echo of `beam` within `tolerance` of `bin`; 0 without one.
  float LoudestNear(int beam, int bin, double tolerance) const {
    float loudest = 0;
    for (const Echo& echo : beams_[beam]) {
      if (std::abs(echo.bin - bin) <= tolerance) loudest = std::max(loudest, echo.loudness);
    }
    return loudest;
  }

  /// What the beams beside `beam` hold where a surface through `bin` would go on.
  float Support(int beam, int bin) const {
    const auto enough = static_cast<float>(options_.lone_loudness);
    const int from = std::max(0, beam - options_.support_beams);
    const int to = std::min(count() - 1, beam + options_.support_beams);
    float support = 0;
    for (int near = from; near <= to; ++near) {
      if (near == beam) continue;
      const double tolerance_bins = slope_bins_ * std::abs(near - beam) + 1;
      support += std::min(enough, LoudestNear(near, bin, tolerance_bins));
    }
    return support;
  }

  /// The support that echoes have by chance: of places where they are not.
  float MeasureClutter(double bin_m) const {
    constexpr double kElsewhere_m[] = {-1.2, -0.8, 0.8, 1.2};
    double sum = 0;
    int places = 0;
    for (int beam = 0; beam < count(); ++beam) {
      for (const Echo& echo : beams_[beam]) {
        for (const double shift_m : kElsewhere_m)
          sum += Support(beam, echo.bin + static_cast<int>(shift_m / bin_m));
        places += static_cast<int>(std::size(kElsewhere_m));
      }
    }
    return places == 0 ? 0 : static_cast<float>(sum / places);
  }

  /// Surfaces go on in the next beams; fish and noise do so by chance alone.
  bool IsSurface(const Echo& echo, int beam) const {
    return echo.loudness >= options_.lone_loudness + clutter_ ||
           echo.loudness + Support(beam, echo.bin) >=
               options_.supported_loudness + options_.clutter_factor * clutter_;
  }

  /// Correlation of two beams' samples around an echo at `bin`.
  float Likeness(int a, int b, int bin) const {
    constexpr int kMargin_bins = 2;
    const int from = std::max(0, bin - kMargin_bins);
    const int to = std::min(frame_.bins, bin + length_bins_ + kMargin_bins);
    float sum_a = 0, sum_b = 0, sum_aa = 0, sum_bb = 0, sum_ab = 0;
    for (int i = from; i < to; ++i) {
      const std::uint8_t* const row = frame_.samples.data() + std::size_t(i) * frame_.beams;
      const float sample_a = row[a], sample_b = row[b];
      sum_a += sample_a;
      sum_b += sample_b;
      sum_aa += sample_a * sample_a;
      sum_bb += sample_b * sample_b;
      sum_ab += sample_a * sample_b;
    }
    const auto n = static_cast<float>(to - from);
    const float scale = (n * sum_aa - sum_a * sum_a) * (n * sum_bb - sum_b * sum_b);
    return scale > 0 ? (n * sum_ab - sum_a * sum_b) / std::sqrt(scale) : 0;
  }

  /// Whether an echo and those beside it are weaker than crosstalk of a beam of its group would be,
  /// or it has the very shape of a stronger one of its group: crosstalk is a copy, down to the
  /// speckle.
  bool IsCrosstalk(const Echo& echo, int beam) const {
    float here = 0;
    for (int near = std::max(0, beam - 1); near <= std::min(count() - 1, beam + 1); ++near)
      here = std::max(here, LoudestNear(near, echo.bin, slope_bins_ + 1));
    for (int other = beam % options_.crosstalk_period_beams; other < count();
         other += options_.crosstalk_period_beams) {
      if (other == beam) continue;
      const float loudest = LoudestNear(other, echo.bin, same_bins_);
      if (here < options_.crosstalk_fraction * loudest) return true;
      if (echo.loudness < options_.copy_fraction * loudest && IsCopy(echo, beam, other))
        return true;
    }
    return false;
  }

  /// Copies are far more alike than the beams of a smooth wall, which are so with their neighbours.
  bool IsCopy(const Echo& echo, int beam, int other) const {
    constexpr float kShare = 0.5;
    const float unlike = 1 - Likeness(beam, other, echo.bin);
    if (unlike >= 1 - options_.copy_likeness) return false;
    for (const int near : {beam - 1, beam + 1}) {
      if (near >= 0 && near < count() && unlike > kShare * (1 - Likeness(beam, near, echo.bin)))
        return false;
    }
    return true;
  }

  const RangeDetectorOptions& options_;
  const SonarFrame& frame_;
  const std::vector<Echoes>& beams_;
  int length_bins_;
  double slope_bins_;
  float clutter_;
  int same_bins_;
};

}  // namespace

std::vector<Beam> DetectRanges(const RangeDetectorOptions& options, const SonarFrame& frame,
                               std::span<const double> bearings_rad) {
  const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
  const EchoFinder finder(options, frame);
  std::vector<Echoes> echoes(frame.beams);
  for (int beam = 0; beam < frame.beams; ++beam) echoes[beam] = finder.Find(beam);
  const EchoJudge judge(options, frame, echoes);
  std::vector<Beam> beams(frame.beams);
  for (int beam = 0; beam < frame.beams; ++beam) {
    beams[beam].bearing_rad = static_cast<float>(bearings_rad[beam]);
    const Echo* const echo = judge.FirstReturn(beam);
    if (!echo) continue;
    beams[beam].status = BeamStatus::kReturn;
    beams[beam].range_m = static_cast<float>(frame.min_range_m + (echo->bin + 0.5) * bin_m);
    beams[beam].strength = echo->peak;
  }
  ClassifySilentBeams(options.guard_beams, beams);
  return beams;
}

}  // namespace vog
