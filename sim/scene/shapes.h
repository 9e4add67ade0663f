#pragma once

#include <functional>
#include <vector>

#include "lib/geometry/triangle_mesh.h"

namespace vog {

/// The corners of a closed outline in space.
using Ring = std::vector<Vec3>;

/// The closed shell through `rings` in order, both ends capped, wound outward. A cap is a ladder
/// with rungs from point i to point n - i, which fills any convex outline, and any other whose
/// rungs lie inside of it (foils, ship sections, the ground under a profile). Between rings
/// farther apart than `max_step_m` it lays others, so that the triangles do not become long and
/// thin.
/// @pre two rings or more, all of the same three points or more.
TriangleMesh Loft(const std::vector<Ring>& rings, double max_step_m);

/// The closed shell through `rings` in order and back to the first one, wound outward; rings laid
/// in between as Loft() does. @pre as Loft(), and three rings or more.
TriangleMesh Loop(std::vector<Ring> rings, double max_step_m);

/// `points` corners on the circle around `center`, perpendicular to `axis`. @pre axis is not zero.
Ring Circle(const Vec3& center, const Vec3& axis, double radius_m, int points);

/// A closed cylinder between the middles of its ends.
TriangleMesh Cylinder(const Vec3& from, const Vec3& to, double radius_m, int points,
                      double max_step_m);

/// A closed pipe, open at its ends. @pre wall_m < radius_m.
TriangleMesh Tube(const Vec3& from, const Vec3& to, double radius_m, double wall_m, int points,
                  double max_step_m);

/// A closed sphere of nearly even triangles.
TriangleMesh Sphere(const Vec3& center, double radius_m, double max_edge_m);

/// A curved plate with openings, given on a grid of `rows` by `columns` cells.
struct PlateGrid {
  int rows = 1, columns = 1;
  /// The corners of both sides, for row 0 to `rows` and column 0 to `columns`.
  std::function<Vec3(int row, int column)> front, back;
  /// Whether a cell is missing.
  std::function<bool(int row, int column)> is_open;
};

/// The closed shell of the plate, with a rim around it and around each opening, wound outward.
/// Where two cells would meet at a corner alone, one of them is opened too.
TriangleMesh Plate(const PlateGrid& grid);

/// A closed box, its sides along the axes of A, its middle at A's origin.
TriangleMesh Box(const Pose3& X_WA, const Vec3& size_m);

/// The same surface with no edge longer than `max_edge_m`. Edges are split in their middle in both
/// triangles that share them: what was closed stays closed.
TriangleMesh Refine(const TriangleMesh& mesh, double max_edge_m);

/// The enclosed volume of closed shells, negative for those that are wound inward.
double SignedVolume(const TriangleMesh& mesh);

}  // namespace vog
