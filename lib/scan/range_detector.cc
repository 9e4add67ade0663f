#include "lib/scan/range_detector.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr int kNone = -1;

struct Echo {
  int bin = kNone;       // Of the first crossing.
  int peak_bin = kNone;  // Of the strongest sample.
  float peak = 0;        // Its excess over the background, 0..1.
};

/// Energies of the frame: samples summed over the `window` bins that end at each bin, as they lie.
std::vector<int> SumOverWindow(const SonarFrame& frame, int window) {
  std::vector<int> energy(frame.samples.size());
  const std::size_t beams = frame.beams;
  for (std::size_t i = 0; i < energy.size(); ++i) {
    energy[i] = frame.samples[i];
    if (i >= beams) energy[i] += energy[i - beams];
    if (i >= window * beams) energy[i] -= frame.samples[i - window * beams];
  }
  return energy;
}

/// The background's energy and its spread around each range. Ordered statistics of many beams and
/// many ranges, because a wall across the fan fills whole rows, and because most samples are 0.
struct NoiseModel {
  std::vector<float> energy, sigma;
};

NoiseModel EstimateNoise(const SonarFrame& frame, const std::vector<int>& energy) {
  constexpr int kHalfWindow_bins = 64, kBlock_bins = 16, kStride_bins = 4;
  NoiseModel noise;
  std::vector<int> sorted;
  for (int block = 0; block < frame.bins; block += kBlock_bins) {
    const int from = std::max(0, block - kHalfWindow_bins);
    const int to = std::min(frame.bins, block + kBlock_bins + kHalfWindow_bins);
    sorted.clear();
    for (int bin = from; bin < to; bin += kStride_bins) {
      const auto row = energy.begin() + std::ptrdiff_t(bin) * frame.beams;
      sorted.insert(sorted.end(), row, row + frame.beams);
    }
    const auto quantile = [&](double share) {
      const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(share * (sorted.size() - 1));
      std::nth_element(sorted.begin(), nth, sorted.end());
      return static_cast<float>(*nth);
    };
    const float median = quantile(0.5);
    const float sigma = std::max(4.0f, median - quantile(0.16));
    for (int bin = block; bin < std::min(frame.bins, block + kBlock_bins); ++bin) {
      noise.energy.push_back(median);
      noise.sigma.push_back(sigma);
    }
  }
  return noise;
}

/// The first stretch of `window` bins whose energy stands out of the noise.
Echo FindEcho(const RangeDetectorOptions& options, const SonarFrame& frame,
              const std::vector<int>& energy, const NoiseModel& noise, int beam, int window) {
  const auto excess = [&](int bin) {
    return (frame.samples[std::size_t(bin) * frame.beams + beam] - noise.energy[bin] / window) /
           255;
  };
  for (int bin = 0; bin < frame.bins; ++bin) {
    const float threshold = noise.energy[bin] + float(options.threshold_sigma) * noise.sigma[bin];
    if (energy[std::size_t(bin) * frame.beams + beam] < threshold) continue;
    // The whole echo: from where its energy came into the window to where it ends.
    const int from = std::max(0, bin - window + 1);
    const int to = std::min(frame.bins, bin + window);
    Echo echo;
    for (int i = from; i < to; ++i) {
      if (excess(i) > echo.peak) echo = {kNone, i, excess(i)};
    }
    for (int i = from; i <= echo.peak_bin && echo.bin == kNone; ++i) {
      if (excess(i) >= options.crossing_fraction * echo.peak) echo.bin = i;
    }
    return echo;
  }
  return {};
}

bool IsCrosstalk(const RangeDetectorOptions& options, const std::vector<Echo>& echoes, int beam,
                 int window) {
  const int count = static_cast<int>(echoes.size());
  for (int other = beam % options.crosstalk_period_beams; other < count;
       other += options.crosstalk_period_beams) {
    const Echo& stronger = echoes[other];
    if (other != beam && stronger.bin != kNone &&
        std::abs(stronger.peak_bin - echoes[beam].peak_bin) <= window &&
        echoes[beam].peak < options.crosstalk_fraction * stronger.peak)
      return true;
  }
  return false;
}

}  // namespace

std::vector<Beam> DetectRanges(const RangeDetectorOptions& options, const SonarFrame& frame,
                               std::span<const double> bearings_rad) {
  const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
  const int window =
      std::clamp(static_cast<int>(std::lround(options.echo_length_m / bin_m)), 1, frame.bins);
  const std::vector<int> energy = SumOverWindow(frame, window);
  const NoiseModel noise = EstimateNoise(frame, energy);
  std::vector<Echo> echoes(frame.beams);
  for (int beam = 0; beam < frame.beams; ++beam)
    echoes[beam] = FindEcho(options, frame, energy, noise, beam, window);
  std::vector<Beam> beams(frame.beams);
  for (int beam = 0; beam < frame.beams; ++beam) {
    beams[beam].bearing_rad = static_cast<float>(bearings_rad[beam]);
    if (echoes[beam].bin == kNone || IsCrosstalk(options, echoes, beam, window)) continue;
    beams[beam].status = BeamStatus::kReturn;
    beams[beam].range_m = static_cast<float>(frame.min_range_m + (echoes[beam].bin + 0.5) * bin_m);
    beams[beam].strength = echoes[beam].peak;
  }
  ClassifySilentBeams(options.guard_beams, beams);
  return beams;
}

}  // namespace vog
