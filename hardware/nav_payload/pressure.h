#pragma once

#include "lib/base/config.h"

namespace vog {

enum class PressureUnit { kPsi, kMillibar, kKilopascal, kDecibar, kBar, kMetresOfWater };
enum class DepthFormula { kUnesco, kDensity };

/// What a pressure gauge's number means.
struct PressureOptions {
  PressureUnit unit = PressureUnit::kPsi;
  double surface_dbar = 10.1325;
  DepthFormula formula = DepthFormula::kUnesco;
  double latitude_deg = 45;
  double density_kg_m3 = 1025;

  void Visit(OptionsVisitor& v) {
    v("unit", unit,
      Names<PressureUnit>{{PressureUnit::kPsi, "psi"},
                          {PressureUnit::kMillibar, "mbar"},
                          {PressureUnit::kKilopascal, "kpa"},
                          {PressureUnit::kDecibar, "dbar"},
                          {PressureUnit::kBar, "bar"},
                          {PressureUnit::kMetresOfWater, "mh2o"}},
      "of the gauge's numbers");
    v("surface_dbar", surface_dbar, Between(0, 20), "what the gauge shows on deck: the air's");
    v("formula", formula,
      Names<DepthFormula>{{DepthFormula::kUnesco, "unesco"}, {DepthFormula::kDensity, "density"}},
      "sea water of 35 and 0 degC that compresses [UNESCO 1983], or one density");
    v("latitude_deg", latitude_deg, Between(-90, 90), "gravity of the UNESCO formula");
    v("density_kg_m3", density_kg_m3, Between(900, 1200), "of the water, for one density");
  }
};

/// Depth [m], down positive, of what the gauge shows. UNESCO: Fofonoff and Millard, "Algorithms for
/// computation of fundamental properties of seawater", Unesco technical papers in marine science
/// 44, 1983, p. 25.
double ToDepth(double gauge, const PressureOptions& options);

/// What the gauge shows at a depth [m]: the inverse.
double ToGauge(double depth_m, const PressureOptions& options);

}  // namespace vog
