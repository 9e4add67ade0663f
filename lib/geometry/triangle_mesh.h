#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// Triangles in W, wound counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  Eigen::AlignedBox3d Bounds() const {
    Eigen::AlignedBox3d bounds;
    for (const Vec3& vertex : vertices) bounds.extend(vertex);
    return bounds;
  }

  void Append(const TriangleMesh& other) {
    const auto offset = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& t : other.triangles)
      triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
};

}  // namespace vog
