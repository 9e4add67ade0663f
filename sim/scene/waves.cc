#include "sim/scene/waves.h"

#include <cmath>
#include <numbers>

namespace vog {

Waves::Waves(double amplitude, double wavelength_m, Directions directions, Random random) {
  constexpr int kWaves = 6;
  double sum_m = 0;
  for (int i = 0; i < kWaves; ++i) {
    const double length_m = random.Uniform(0.5, 1) * wavelength_m;
    const double heading_rad = random.Uniform(0, 2 * std::numbers::pi);
    const double up = directions == Directions::kAll ? random.Uniform(-1, 1) : 0;
    const double level = std::sqrt(1 - up * up);
    const Vec3 direction(level * std::cos(heading_rad), level * std::sin(heading_rad), up);
    waves_.push_back({length_m, random.Uniform(0, 2 * std::numbers::pi),
                      2 * std::numbers::pi / length_m * direction});
    sum_m += length_m;
  }
  for (Wave& wave : waves_) wave.amplitude *= amplitude / sum_m;
}

double Waves::At(const Vec3& p) const {
  double sum = 0;
  for (const Wave& wave : waves_)
    sum += wave.amplitude * std::sin(wave.number_rad_m.dot(p) + wave.phase_rad);
  return sum;
}

}  // namespace vog
