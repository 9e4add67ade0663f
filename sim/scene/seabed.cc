#include "sim/scene/seabed.h"

#include <algorithm>
#include <cmath>

#include "sim/scene/shapes.h"

namespace vog {

Seabed::Seabed(double level_m, double relief_m, double wavelength_m, std::int64_t seed)
    : level_m_(level_m),
      relief_m_(relief_m),
      waves_(relief_m, wavelength_m, Waves::Directions::kLevel,
             Random(static_cast<std::uint64_t>(seed), "scene seabed")) {}

double Seabed::HeightAt(double x_m, double y_m) const {
  return level_m_ + waves_.At({x_m, y_m, 0});
}

TriangleMesh Seabed::Slab(const Eigen::AlignedBox2d& area_W, double max_edge_m) const {
  constexpr double kThickness_m = 1;
  const double bottom_m = level_m_ - relief_m_ - kThickness_m;
  const Eigen::Vector2d size_m = area_W.sizes();
  // Squares whose diagonal is the longest edge.
  const Eigen::Array2i cells =
      (size_m.array() / (max_edge_m / std::sqrt(2))).ceil().cast<int>().cwiseMax(1);
  const auto place = [&](int axis, int i) {
    return area_W.min()[axis] + size_m[axis] * i / cells[axis];
  };
  std::vector<Ring> sections;
  for (int i = 0; i <= cells.x(); ++i) {
    const double x = place(0, i);
    Ring section = {{x, place(1, 0), bottom_m}};
    for (int j = 0; j <= cells.y(); ++j)
      section.push_back({x, place(1, j), HeightAt(x, place(1, j))});
    for (int j = cells.y(); j > 0; --j) section.push_back({x, place(1, j), bottom_m});
    sections.push_back(std::move(section));
  }
  return Loft(sections, max_edge_m);
}

Eigen::AlignedBox2d AreaAround(const TriangleMesh& structure_W, double margin_m) {
  const Eigen::AlignedBox3d bounds = structure_W.Bounds();
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(margin_m);
  return {bounds.min().head<2>() - margin, bounds.max().head<2>() + margin};
}

}  // namespace vog
