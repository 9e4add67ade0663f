#include "sim/scene/overlap.h"

#include <algorithm>

namespace vog {
namespace {

using Corners = std::array<Vec3, 3>;

/// Whether the triangle lies beyond the box's reach along `axis`, all in the box's frame.
bool Separates(const Vec3& axis, const Corners& corners, const Vec3& half_m) {
  const double reach = axis.cwiseAbs().dot(half_m);
  const auto [low, high] =
      std::minmax({axis.dot(corners[0]), axis.dot(corners[1]), axis.dot(corners[2])});
  return low > reach || high < -reach;
}

bool Touches(const Corners& corners, const Vec3& half_m) {
  for (int i = 0; i < 3; ++i) {
    if (Separates(Vec3::Unit(i), corners, half_m)) return false;
  }
  const Corners edges = {corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
  if (Separates(edges[0].cross(edges[1]), corners, half_m)) return false;
  for (const Vec3& edge : edges) {
    for (int i = 0; i < 3; ++i) {
      if (Separates(Vec3::Unit(i).cross(edge), corners, half_m)) return false;
    }
  }
  return true;
}

}  // namespace

bool BoxTouches(const TriangleMesh& mesh, const Pose3& X_WB, const Vec3& size_m) {
  const Pose3 X_BW = X_WB.inverse();
  const Vec3 half_m = 0.5 * size_m;
  const Vec3 reach_W = X_WB.linear().cwiseAbs() * half_m;
  const Vec3 low_W = X_WB.translation() - reach_W, high_W = X_WB.translation() + reach_W;
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    const Corners corners_W = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    for (int i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax({corners_W[0][i], corners_W[1][i], corners_W[2][i]});
      if (low > high_W[i] || high < low_W[i]) return false;
    }
    return Touches({X_BW * corners_W[0], X_BW * corners_W[1], X_BW * corners_W[2]}, half_m);
  });
}

}  // namespace vog
