#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/random.h"
#include "lib/scan/sonar.h"
#include "sim/sensors/beam_caster.h"

namespace vog {

/// The level of a single look at many scatterers: Rayleigh distributed, of mean 1.
double DrawFading(Random& random);

/// The share of an amplitude that is left `db` lower.
double Attenuation(double db);

/// Makes the intensities of an imaging sonar from what its beams meet: speckled echoes, crosstalk,
/// ghosts, and a background of reverberation that is often 0 and otherwise exponentially
/// distributed.
class FramePainter {
 public:
  /// How loud each beam's background is belongs to the sonar: Random(seed, "sonar_gain", beam).
  FramePainter(const SonarOptions& options, const SonarModelOptions& model, std::uint64_t seed);

  /// `samples[bin * beams + beam]`, from near to far.
  std::vector<std::uint8_t> Paint(const std::vector<BeamEchoes>& beams, Random& random) const;

 private:
  /// Amplitudes of all samples, laid out as they are.
  using Image = std::vector<float>;

  std::vector<double> BackgroundChances() const;
  void PaintBeam(std::size_t beam, const BeamEchoes& echoes, Random& random, Image& image) const;
  void PaintEcho(std::size_t beam, double range_m, double amplitude, Image& image) const;
  void AddCrosstalk(Random& random, Image& image) const;
  double DrawBackground(double chance, Random& random) const;

  SonarModelOptions model_;
  double min_range_m_, max_range_m_, bin_m_;
  std::vector<double> gains_;               // Of each beam's background.
  std::vector<double> background_chances_;  // Of each bin's samples not to be 0, at gain 1.
};

}  // namespace vog
