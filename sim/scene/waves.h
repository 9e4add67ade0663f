#pragma once

#include <vector>

#include "lib/base/random.h"
#include "lib/geometry/pose.h"

namespace vog {

/// A smooth random function of space: a few plane waves in all directions of the x-y plane or of
/// space. It stays within +/- its amplitude.
class Waves {
 public:
  enum class Directions { kLevel, kAll };

  /// Wavelengths are between half of `wavelength_m` and all of it; long waves are higher.
  Waves(double amplitude, double wavelength_m, Directions directions, Random random);

  double At(const Vec3& p) const;

 private:
  struct Wave {
    double amplitude, phase_rad;
    Vec3 number_rad_m;
  };
  std::vector<Wave> waves_;
};

}  // namespace vog
