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

void AppendSide(std::uint32_t first, std::uint32_t points, TriangleMesh& mesh) {
  for (std::uint32_t i = 0; i < points; ++i) {
    const std::uint32_t a = first + i, b = first + (i + 1) % points;
    mesh.triangles.push_back({a, b, b + points});
    mesh.triangles.push_back({a, b + points, a + points});
  }
}

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

}  // namespace

TriangleMesh Loft(const std::vector<Ring>& rings, double max_step_m) {
  TriangleMesh mesh;
  const auto points = static_cast<std::uint32_t>(rings.front().size());
  for (const Ring& ring : Densify(rings, max_step_m))
    mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size()) - points;
  AppendCap(0, points, /*reversed=*/true, mesh);
  for (std::uint32_t first = 0; first < last; first += points) AppendSide(first, points, mesh);
  AppendCap(last, points, /*reversed=*/false, mesh);
  if (SignedVolume(mesh) < 0) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  }
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
