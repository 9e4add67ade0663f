#include "sim/scene/tank.h"

#include <algorithm>
#include <cmath>

#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kDegree_rad = EIGEN_PI / 180;

/// Parts that stand on another one reach this far into it: two faces in one place have no outside.
constexpr double kSunk_m = 0.01;

double FloorTop(const TankOptions& options) {
  return -0.5 * options.height_m + options.wall_thickness_m;
}

/// Wall and floor as one body, turned around the z axis.
TriangleMesh MakeShell(const TankOptions& options) {
  const double outer = 0.5 * options.diameter_m, inner = outer - options.wall_thickness_m;
  const double bottom = -0.5 * options.height_m, rim = 0.5 * options.height_m;
  std::vector<Ring> rings;
  const auto turn = [&](double radius, double z) {
    rings.push_back(Circle({0, 0, z}, Vec3::UnitZ(), radius, options.facets));
  };
  // A cap as wide as the tank would be all long thin triangles.
  constexpr double kCapShare = 0.3;
  turn(kCapShare * outer, bottom);
  turn(outer, bottom);
  turn(outer, rim);
  turn(inner, rim);
  turn(inner, FloorTop(options));
  turn(kCapShare * inner, FloorTop(options));
  return Loft(rings, options.max_edge_m);
}

TriangleMesh MakeBox(const TankOptions& options) {
  const Vec3 size_m = options.box_size_m + Vec3(0, 0, kSunk_m);
  const double z = FloorTop(options) - kSunk_m + 0.5 * size_m.z();
  return Box(
      MakePose({options.box_x_m, options.box_y_m, z}, {0, 0, options.box_yaw_deg * kDegree_rad}),
      size_m);
}

/// Two rails from the floor to the rim, with rungs between them.
TriangleMesh MakeLadder(const TankOptions& options) {
  constexpr int kPoints = 12;
  const double bearing = options.ladder_bearing_deg * kDegree_rad;
  const double distance = 0.5 * options.diameter_m - options.wall_thickness_m -
                          options.ladder_clearance_m - 0.5 * options.ladder_rail_diameter_m;
  // L: x away from the middle of the tank, y across the ladder.
  const Pose3 X_WL =
      MakePose({distance * std::cos(bearing), distance * std::sin(bearing), 0}, {0, 0, bearing});
  const double half = 0.5 * options.ladder_width_m;
  const double bottom = FloorTop(options), top = 0.5 * options.height_m;
  TriangleMesh ladder;
  for (const double y : {-half, half}) {
    ladder.Append(Cylinder(X_WL * Vec3(0, y, bottom - kSunk_m), X_WL * Vec3(0, y, top),
                           0.5 * options.ladder_rail_diameter_m, kPoints, options.max_edge_m));
  }
  for (int i = 1; i <= options.ladder_rungs; ++i) {
    const double z = bottom + (top - bottom) * i / (options.ladder_rungs + 1);
    ladder.Append(Cylinder(X_WL * Vec3(0, -half, z), X_WL * Vec3(0, half, z),
                           0.5 * options.ladder_rung_diameter_m, kPoints, options.max_edge_m));
  }
  return ladder;
}

}  // namespace

void TankOptions::Validate() const {
  if (wall_thickness_m >= 0.25 * std::min(diameter_m, height_m))
    throw UsageError("scene.tank.wall_thickness_m leaves no room in the tank");
  if (ladder_clearance_m + ladder_rail_diameter_m + wall_thickness_m >= 0.5 * diameter_m)
    throw UsageError("scene.tank.ladder_clearance_m puts the ladder beyond the tank's middle");
}

TriangleMesh GenerateTank(const TankOptions& options) {
  options.Validate();
  TriangleMesh mesh = MakeShell(options);
  mesh.Append(MakeBox(options));
  mesh.Append(MakeLadder(options));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
