#include "hardware/nav_payload/pressure.h"

#include <cmath>

#include "lib/geometry/pose.h"

namespace vog {
namespace {

constexpr double kPascalPerDecibar = 1e4;
constexpr double kStandardGravity = 9.80665;

double DecibarOf(PressureUnit unit) {
  switch (unit) {
    case PressureUnit::kPsi:
      return 0.6894757293168;
    case PressureUnit::kMillibar:
      return 0.01;
    case PressureUnit::kKilopascal:
      return 0.1;
    case PressureUnit::kDecibar:
      return 1;
    case PressureUnit::kBar:
      return 10;
    case PressureUnit::kMetresOfWater:
      return 0.980665;
  }
  return 1;
}

double UnescoDepth(double p_dbar, double latitude_deg) {
  const double x = std::pow(std::sin(ToRadians(latitude_deg)), 2);
  const double gravity = 9.780318 * (1 + (5.2788e-3 + 2.36e-5 * x) * x) + 1.092e-6 * p_dbar;
  return (((-1.82e-15 * p_dbar + 2.279e-10) * p_dbar - 2.2512e-5) * p_dbar + 9.72659) * p_dbar /
         gravity;
}

double MetresPerDecibar(const PressureOptions& options) {
  return kPascalPerDecibar / (options.density_kg_m3 * kStandardGravity);
}

/// The pressure at a depth: the formula's slope is nearly 1 m/dbar, so each round gains two digits.
double UnescoPressure(double depth_m, double latitude_deg) {
  double p_dbar = depth_m;
  for (int round = 0; round < 12; ++round) p_dbar += depth_m - UnescoDepth(p_dbar, latitude_deg);
  return p_dbar;
}

}  // namespace

double ToDepth(double gauge, const PressureOptions& options) {
  const double p_dbar = gauge * DecibarOf(options.unit) - options.surface_dbar;
  if (options.formula == DepthFormula::kUnesco) return UnescoDepth(p_dbar, options.latitude_deg);
  return p_dbar * MetresPerDecibar(options);
}

double ToGauge(double depth_m, const PressureOptions& options) {
  const double p_dbar = options.formula == DepthFormula::kUnesco
                            ? UnescoPressure(depth_m, options.latitude_deg)
                            : depth_m / MetresPerDecibar(options);
  return (p_dbar + options.surface_dbar) / DecibarOf(options.unit);
}

}  // namespace vog
