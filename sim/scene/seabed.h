#pragma once

#include <cstdint>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/waves.h"

namespace vog {

/// An undulating sea floor that stays within `relief_m` of its mean level.
class Seabed {
 public:
  Seabed(double level_m, double relief_m, double wavelength_m, std::int64_t seed);

  /// z of the floor in W.
  double HeightAt(double x_m, double y_m) const;

  /// The floor over a rectangle, as a closed slab with a flat underside. It goes down a metre below
  /// the deepest place there may be, so that nothing looks under it.
  TriangleMesh Slab(const Eigen::AlignedBox2d& area_W, double max_edge_m) const;

 private:
  double level_m_, relief_m_;
  Waves waves_;
};

/// The rectangle under a structure and `margin_m` around it.
Eigen::AlignedBox2d AreaAround(const TriangleMesh& structure_W, double margin_m);

}  // namespace vog
