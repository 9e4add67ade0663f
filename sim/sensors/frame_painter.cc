#include "sim/sensors/frame_painter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace vog {
namespace {

constexpr double kFullScale = 255;
constexpr double kFaintest = 1e-3;  // Amplitudes below this round to 0.

}  // namespace

double DrawFading(Random& random) {
  return 2 / std::sqrt(std::numbers::pi) * std::sqrt(-std::log(1 - random.Uniform(0, 1)));
}

double Attenuation(double db) { return std::pow(10, -db / 20); }

FramePainter::FramePainter(const SonarOptions& options, const SonarModelOptions& model,
                           std::uint64_t seed)
    : model_(model),
      min_range_m_(options.min_range_m),
      max_range_m_(options.max_range_m),
      bin_m_((options.max_range_m - options.min_range_m) / model.frame_bins),
      background_chances_(BackgroundChances()) {
  const double spread = model.beam_gain_spread;
  for (int beam = 0; beam < options.beams; ++beam) {
    gains_.push_back(
        Random(seed, "sonar_gain", beam).Uniform(2 / (1 + spread), 2 * spread / (1 + spread)));
  }
}

/// Falling from the window's start to a floor, with the mean that the options say.
std::vector<double> FramePainter::BackgroundChances() const {
  std::vector<double> chances;
  for (int bin = 0; bin < model_.frame_bins; ++bin) {
    const double fallen = std::exp(-(bin + 0.5) * bin_m_ / model_.background_rise_length_m);
    chances.push_back(1 + (model_.background_rise - 1) * fallen);
  }
  const double mean = std::accumulate(chances.begin(), chances.end(), 0.0) / model_.frame_bins;
  for (double& chance : chances) chance *= (1 - model_.background_zero_probability) / mean;
  return chances;
}

std::vector<std::uint8_t> FramePainter::Paint(const std::vector<BeamEchoes>& beams,
                                              Random& random) const {
  Image image(beams.size() * model_.frame_bins);
  for (std::size_t beam = 0; beam < beams.size(); ++beam)
    PaintBeam(beam, beams[beam], random, image);
  // Crosstalk is of the echoes as they arrive, so it has their speckle.
  for (float& amplitude : image) {
    if (amplitude > kFaintest) amplitude *= static_cast<float>(DrawFading(random));
  }
  AddCrosstalk(random, image);
  std::vector<std::uint8_t> samples(image.size());
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::size_t beam = i % beams.size(), bin = i / beams.size();
    const double background = DrawBackground(gains_[beam] * background_chances_[bin], random);
    const double level = std::round(background + kFullScale * image[i]);
    samples[i] = static_cast<std::uint8_t>(std::min(level, kFullScale));
  }
  return samples;
}

void FramePainter::PaintBeam(std::size_t beam, const BeamEchoes& echoes, Random& random,
                             Image& image) const {
  for (const Echo& echo : echoes) {
    const double range_m = echo.range_m + random.Gaussian(model_.range_noise_m);
    const bool lost = random.Chance(model_.miss_probability);
    if (!lost) PaintEcho(beam, range_m, model_.echo_level * echo.share, image);
  }
  if (random.Chance(model_.double_bounce_probability) && !echoes.empty()) {
    PaintEcho(beam, 2 * echoes.front().range_m,
              model_.echo_level * echoes.front().share * Attenuation(model_.double_bounce_db),
              image);
  }
  const double false_range_m = random.Uniform(min_range_m_, max_range_m_);
  const double false_share = random.Uniform(0.3, 1);
  if (random.Chance(model_.false_return_probability))
    PaintEcho(beam, false_range_m, model_.echo_level * false_share, image);
}

/// A bell whose near side passes half of its height at the range, where detectors look.
void FramePainter::PaintEcho(std::size_t beam, double range_m, double amplitude,
                             Image& image) const {
  const double sigma_m = model_.echo_length_m / (2 * std::sqrt(2 * std::numbers::ln2));
  const double middle_m = range_m + 0.5 * model_.echo_length_m - min_range_m_;
  const int from = static_cast<int>(std::floor((middle_m - 3 * sigma_m) / bin_m_));
  const int to = static_cast<int>(std::ceil((middle_m + 3 * sigma_m) / bin_m_));
  for (int bin = std::max(0, from); bin < std::min(model_.frame_bins, to); ++bin) {
    const double distance = ((bin + 0.5) * bin_m_ - middle_m) / sigma_m;
    image[bin * gains_.size() + beam] +=
        static_cast<float>(amplitude * std::exp(-0.5 * distance * distance));
  }
}

/// Echoes show, weaker, in the next beams that fire with theirs.
void FramePainter::AddCrosstalk(Random& random, Image& image) const {
  const int beams = static_cast<int>(gains_.size());
  const Image echoes = image;
  for (const int groups : {-2, -1, 1, 2}) {
    const int offset = groups * model_.crosstalk_period_beams;
    const auto share = static_cast<float>(
        Attenuation(random.Uniform(model_.crosstalk_min_db, model_.crosstalk_max_db)));
    for (int bin = 0; bin < model_.frame_bins; ++bin) {
      float* const row = image.data() + static_cast<std::ptrdiff_t>(bin) * beams;
      const float* const echo_row = echoes.data() + static_cast<std::ptrdiff_t>(bin) * beams;
      for (int to = std::max(0, offset); to < std::min(beams, beams + offset); ++to)
        row[to] += share * echo_row[to - offset];
    }
  }
}

/// A sample's background in steps of the scale; `chance` is that of a sample that is not 0.
double FramePainter::DrawBackground(double chance, Random& random) const {
  const double u = random.Uniform(0, 1);
  if (u >= chance) return 0;
  // Rounding up keeps it above 0; that adds half a step, which the exponential leaves out.
  const double mean = std::max(0.1, kFullScale * model_.background_level - 0.5);
  return std::max(1.0, std::ceil(-mean * std::log(1 - u / chance)));
}

}  // namespace vog
