#include "hardware/sonar/lens.h"

#include <string>

#include "lib/base/errors.h"
#include "lib/scan/sonar.h"

namespace vog {
namespace {

constexpr double kFov_deg = 28.8;

/// beam, counted from 1 = factor * (a0 d^3 + a1 d^2 + a2 d + a3 + 1) at a bearing of d degrees. It
/// grows with d everywhere.
struct Cubic {
  double factor, a0, a1, a2, a3;

  double BeamAt(double d) const { return factor * (((a0 * d + a1) * d + a2) * d + a3 + 1); }
};

const Cubic& CubicOf(int beams) {
  static constexpr Cubic k96 = {1.012, 0.0030, -0.0055, 2.6829, 48.04};
  static constexpr Cubic k48 = {1, 0.0015, -0.0036, 1.3351, 24.0976};
  if (beams != 96 && beams != 48)
    throw UsageError("a DIDSON has 96 or 48 beams, not " + std::to_string(beams));
  return beams == 96 ? k96 : k48;
}

/// By bisection: exact to the last bits, and the same on all machines.
double BearingOf(const Cubic& cubic, int beam) {
  double low_deg = -kFov_deg, high_deg = kFov_deg;
  for (int i = 0; i < 60; ++i) {
    const double middle_deg = (low_deg + high_deg) / 2;
    (cubic.BeamAt(middle_deg) < beam + 1 ? low_deg : high_deg) = middle_deg;
  }
  return ToRadians((low_deg + high_deg) / 2);
}

}  // namespace

std::vector<double> DidsonBearings(int beams, BeamSpacing spacing) {
  const Cubic& cubic = CubicOf(beams);
  if (spacing == BeamSpacing::kUniform) {
    SonarOptions options;
    options.beams = beams;
    options.fov_deg = kFov_deg;
    return BeamBearings(options);
  }
  std::vector<double> bearings_rad(static_cast<std::size_t>(beams));
  for (int beam = 0; beam < beams; ++beam) bearings_rad[beam] = BearingOf(cubic, beam);
  return bearings_rad;
}

double LensBeamAt(int beams, double bearing_rad) {
  return CubicOf(beams).BeamAt(ToDegrees(bearing_rad)) - 1;
}

}  // namespace vog
