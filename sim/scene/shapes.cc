#include "sim/scene/shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace vog {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// The same rings with others in between, evenly spaced.
std::vector<Ring> Densify(const std::vector<Ring>& rings, double max_step_m) {
  std::vector<Ring> dense = {rings.front()};
  for (std::size_t k = 1; k < rings.size(); ++k) {
    const Ring &a = rings[k - 1], &b = rings[k];
    double distance_m = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      distance_m = std::max(distance_m, (b[i] - a[i]).norm());
    const int steps = std::max(1, static_cast<int>(std::ceil(distance_m / max_step_m)));
    for (int step = 1; step <= steps; ++step) {
      const double share = static_cast<double>(step) / steps;
      Ring ring;
      for (std::size_t i = 0; i < a.size(); ++i) ring.push_back(a[i] + share * (b[i] - a[i]));
      dense.push_back(std::move(ring));
    }
  }
  return dense;
}

/// Fills the ring whose first point is `first`, wound as the ring runs.
void AppendCap(std::uint32_t first, std::uint32_t points, bool reversed, TriangleMesh& mesh) {
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (reversed) std::swap(b, c);
    mesh.triangles.push_back({first + a, first + b, first + c});
  };
  std::uint32_t low = 1, high = points - 1;
  add(0, low, high);
  while (high - low > 1) {
    add(low, low + 1, high);
    ++low;
    if (high - low > 1) {
      add(low, high - 1, high);
      --high;
    }
  }
}

void AppendQuad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                TriangleMesh& mesh) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

/// Between the rings whose first points are `first` and `second`.
void AppendSide(std::uint32_t first, std::uint32_t second, std::uint32_t points,
                TriangleMesh& mesh) {
  for (std::uint32_t i = 0; i < points; ++i) {
    const std::uint32_t next = (i + 1) % points;
    AppendQuad(first + i, first + next, second + next, second + i, mesh);
  }
}

void WindOutward(TriangleMesh& mesh) {
  if (SignedVolume(mesh) >= 0) return;
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

/// Which cells of a plate are there.
class PlateCells {
 public:
  explicit PlateCells(const PlateGrid& grid)
      : rows_(grid.rows), columns_(grid.columns), solid_(grid.rows * grid.columns) {
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < columns_; ++c) solid_[r * columns_ + c] = !grid.is_open(r, c);
    while (OpenDiagonals()) {
    }
  }

  bool IsSolid(int row, int column) const {
    return row >= 0 && row < rows_ && column >= 0 && column < columns_ &&
           solid_[row * columns_ + column];
  }

 private:
  /// Two cells that meet at a corner alone would share an edge that four triangles have.
  bool OpenDiagonals() {
    bool has_opened = false;
    for (int r = 1; r < rows_; ++r)
      for (int c = 1; c < columns_; ++c) {
        const bool a = IsSolid(r - 1, c - 1), b = IsSolid(r - 1, c);
        if (a == b || a != IsSolid(r, c) || b != IsSolid(r, c - 1)) continue;
        solid_[r * columns_ + (a ? c : c - 1)] = false;
        has_opened = true;
      }
    return has_opened;
  }

  int rows_, columns_;
  std::vector<bool> solid_;
};

/// The corners of a plate's two sheets, those that are asked for.
class PlateCorners {
 public:
  PlateCorners(const PlateGrid& grid, TriangleMesh& mesh) : grid_(grid), mesh_(mesh) {}

  std::uint32_t Front(int row, int column) { return Find(row, column, front_, grid_.front); }
  std::uint32_t Back(int row, int column) { return Find(row, column, back_, grid_.back); }

 private:
  using Numbers = std::map<std::pair<int, int>, std::uint32_t>;

  std::uint32_t Find(int row, int column, Numbers& numbers,
                     const std::function<Vec3(int, int)>& place) {
    const auto [found, is_new] = numbers.try_emplace({row, column}, mesh_.vertices.size());
    if (is_new) mesh_.vertices.push_back(place(row, column));
    return found->second;
  }

  const PlateGrid& grid_;
  TriangleMesh& mesh_;
  Numbers front_, back_;
};

/// The edges to be split in one pass, each with its middle point.
class EdgeSplitter {
 public:
  explicit EdgeSplitter(TriangleMesh& mesh) : mesh_(mesh) {}

  /// Only the longest edge of a triangle: so that the pieces do not become thin.
  void MarkLongestOf(const Triangle& t, double max_edge_m) {
    int longest = 0;
    for (int i = 1; i < 3; ++i) {
      if (Length(t, i) > Length(t, longest)) longest = i;
    }
    if (Length(t, longest) <= max_edge_m) return;
    const std::uint32_t a = t[longest], b = t[(longest + 1) % 3];
    const auto [place, is_new] = middles_.try_emplace(std::minmax(a, b), mesh_.vertices.size());
    if (is_new) mesh_.vertices.push_back(0.5 * (mesh_.vertices[a] + mesh_.vertices[b]));
  }

  std::optional<std::uint32_t> MiddleOf(std::uint32_t a, std::uint32_t b) const {
    const auto found = middles_.find(std::minmax(a, b));
    return found == middles_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  double Length(const Triangle& t, int edge) const {
    return (mesh_.vertices[t[edge]] - mesh_.vertices[t[(edge + 1) % 3]]).norm();
  }

  TriangleMesh& mesh_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

/// The two triangles of a plane quadrilateral, cut along its shorter diagonal.
std::array<Triangle, 2> Cut(const std::vector<Vec3>& vertices,
                            const std::array<std::uint32_t, 4>& q) {
  const double first = (vertices[q[0]] - vertices[q[2]]).squaredNorm();
  const double second = (vertices[q[1]] - vertices[q[3]]).squaredNorm();
  if (first <= second) return {Triangle{q[0], q[1], q[2]}, Triangle{q[0], q[2], q[3]}};
  return {Triangle{q[0], q[1], q[3]}, Triangle{q[1], q[2], q[3]}};
}

void Split(Triangle t, const EdgeSplitter& edges, const std::vector<Vec3>& vertices,
           std::vector<Triangle>& out) {
  std::array<std::optional<std::uint32_t>, 3> middle;
  for (int i = 0; i < 3; ++i) middle[i] = edges.MiddleOf(t[i], t[(i + 1) % 3]);
  const auto count = std::count_if(middle.begin(), middle.end(), [](auto& m) { return !!m; });
  // Turned so that the first edge is split and, where one is not, the last is not.
  while ((count == 1 || count == 2) && !(middle[0] && !middle[2])) {
    std::rotate(t.begin(), t.begin() + 1, t.end());
    std::rotate(middle.begin(), middle.begin() + 1, middle.end());
  }
  const auto [a, b, c] = t;
  if (count == 0) {
    out.push_back(t);
  } else if (count == 1) {
    out.insert(out.end(), {{a, *middle[0], c}, {*middle[0], b, c}});
  } else if (count == 2) {
    out.push_back({*middle[0], b, *middle[1]});
    const auto rest = Cut(vertices, {a, *middle[0], *middle[1], c});
    out.insert(out.end(), rest.begin(), rest.end());
  } else {
    out.insert(out.end(), {{a, *middle[0], *middle[2]},
                           {*middle[0], b, *middle[1]},
                           {*middle[2], *middle[1], c},
                           {*middle[0], *middle[1], *middle[2]}});
  }
}

/// With its middle at the origin and a corner at each end of the z axis.
TriangleMesh Icosahedron(double radius_m) {
  const double z = 1 / std::sqrt(5.0), r = 2 * z;
  TriangleMesh mesh;
  mesh.vertices.push_back({0, 0, radius_m});
  for (int i = 0; i < 10; ++i) {  // Five corners above the middle, five below, in turn.
    const double angle = i * std::numbers::pi / 5;
    mesh.vertices.push_back(radius_m *
                            Vec3(r * std::cos(angle), r * std::sin(angle), i % 2 == 0 ? z : -z));
  }
  mesh.vertices.push_back({0, 0, -radius_m});
  for (std::uint32_t i = 0; i < 10; i += 2) {
    const std::uint32_t up = 1 + i, down = 2 + i, up2 = 1 + (i + 2) % 10, down2 = 2 + (i + 2) % 10;
    mesh.triangles.insert(mesh.triangles.end(),
                          {{0, up, up2}, {up, down, up2}, {up2, down, down2}, {11, down2, down}});
  }
  return mesh;
}

}  // namespace

TriangleMesh Loft(const std::vector<Ring>& rings, double max_step_m) {
  TriangleMesh mesh;
  const auto points = static_cast<std::uint32_t>(rings.front().size());
  for (const Ring& ring : Densify(rings, max_step_m))
    mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size()) - points;
  AppendCap(0, points, /*reversed=*/true, mesh);
  for (std::uint32_t first = 0; first < last; first += points)
    AppendSide(first, first + points, points, mesh);
  AppendCap(last, points, /*reversed=*/false, mesh);
  WindOutward(mesh);
  return mesh;
}

TriangleMesh Loop(std::vector<Ring> rings, double max_step_m) {
  TriangleMesh mesh;
  const auto points = static_cast<std::uint32_t>(rings.front().size());
  rings.push_back(rings.front());
  rings = Densify(rings, max_step_m);
  rings.pop_back();
  for (const Ring& ring : rings)
    mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  const auto count = static_cast<std::uint32_t>(rings.size());
  for (std::uint32_t i = 0; i < count; ++i)
    AppendSide(i * points, (i + 1) % count * points, points, mesh);
  WindOutward(mesh);
  return mesh;
}

TriangleMesh Plate(const PlateGrid& grid) {
  const PlateCells cells(grid);
  TriangleMesh mesh;
  PlateCorners at(grid, mesh);
  const auto rim = [&](int r0, int c0, int r1, int c1) {
    AppendQuad(at.Front(r0, c0), at.Back(r0, c0), at.Back(r1, c1), at.Front(r1, c1), mesh);
  };
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      if (!cells.IsSolid(r, c)) continue;
      AppendQuad(at.Front(r, c), at.Front(r + 1, c), at.Front(r + 1, c + 1), at.Front(r, c + 1),
                 mesh);
      AppendQuad(at.Back(r, c), at.Back(r, c + 1), at.Back(r + 1, c + 1), at.Back(r + 1, c), mesh);
      if (!cells.IsSolid(r, c - 1)) rim(r, c, r + 1, c);
      if (!cells.IsSolid(r + 1, c)) rim(r + 1, c, r + 1, c + 1);
      if (!cells.IsSolid(r, c + 1)) rim(r + 1, c + 1, r, c + 1);
      if (!cells.IsSolid(r - 1, c)) rim(r, c + 1, r, c);
    }
  WindOutward(mesh);
  return mesh;
}

Ring Circle(const Vec3& center, const Vec3& axis, double radius_m, int points) {
  const Vec3 u = axis.unitOrthogonal();
  const Vec3 v = axis.normalized().cross(u);
  Ring ring;
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * std::numbers::pi * i / points;
    ring.push_back(center + radius_m * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return ring;
}

TriangleMesh Cylinder(const Vec3& from, const Vec3& to, double radius_m, int points,
                      double max_step_m) {
  return Loft({Circle(from, to - from, radius_m, points), Circle(to, to - from, radius_m, points)},
              max_step_m);
}

TriangleMesh Box(const Pose3& X_WA, const Vec3& size_m) {
  std::vector<Ring> rings;
  for (const double z : {-0.5, 0.5}) {
    Ring ring;
    for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
      ring.push_back(X_WA * Vec3(x, y, z).cwiseProduct(size_m));
    rings.push_back(ring);
  }
  return Loft(rings, size_m.maxCoeff());
}

TriangleMesh Tube(const Vec3& from, const Vec3& to, double radius_m, double wall_m, int points,
                  double max_step_m) {
  const Vec3 axis = to - from;
  const double inner_m = radius_m - wall_m;
  return Loop({Circle(from, axis, radius_m, points), Circle(to, axis, radius_m, points),
               Circle(to, axis, inner_m, points), Circle(from, axis, inner_m, points)},
              max_step_m);
}

TriangleMesh Sphere(const Vec3& center, double radius_m, double max_edge_m) {
  // Around the poles of an icosahedron, and a bit in hand for edges that grow when they are bent.
  constexpr double kGrowth = 1.3;
  TriangleMesh sphere = Refine(Icosahedron(radius_m), max_edge_m / kGrowth);
  for (Vec3& vertex : sphere.vertices) vertex = center + radius_m * vertex.normalized();
  return sphere;
}

TriangleMesh Refine(const TriangleMesh& mesh, double max_edge_m) {
  TriangleMesh refined = mesh;
  for (std::size_t before = 0; before != refined.triangles.size();) {
    before = refined.triangles.size();
    EdgeSplitter edges(refined);
    for (const Triangle& t : refined.triangles) edges.MarkLongestOf(t, max_edge_m);
    std::vector<Triangle> triangles;
    for (const Triangle& t : refined.triangles) Split(t, edges, refined.vertices, triangles);
    refined.triangles = std::move(triangles);
  }
  return refined;
}

double SignedVolume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = mesh.vertices.front();
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin;
    const Vec3 b = mesh.vertices[t[1]] - origin;
    const Vec3 c = mesh.vertices[t[2]] - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

}  // namespace vog
