#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/shapes.h"

/// What the tests of meshes ask of them.
namespace vog {

/// Whether each edge belongs to two triangles that run along it in opposite directions.
inline bool IsClosed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) ++uses[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : uses) {
    const auto opposite = uses.find({edge.second, edge.first});
    if (count != 1 || opposite == uses.end()) return false;
  }
  return !mesh.triangles.empty();
}

/// Twice the number of pieces, less two for each hole through them, of a closed mesh without stray
/// vertices.
inline int EulerNumber(const TriangleMesh& mesh) {
  return static_cast<int>(mesh.vertices.size()) - static_cast<int>(mesh.triangles.size() / 2);
}

/// The pieces that share no vertex with each other. They keep all vertices.
inline std::vector<TriangleMesh> PartsOf(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) parent[root(t[1])] = parent[root(t[2])] = root(t[0]);
  std::map<std::uint32_t, TriangleMesh> parts;
  for (const auto& t : mesh.triangles) {
    TriangleMesh& part = parts[root(t[0])];
    part.vertices = mesh.vertices;
    part.triangles.push_back(t);
  }
  std::vector<TriangleMesh> list;
  for (auto& [number, part] : parts) list.push_back(std::move(part));
  return list;
}

/// `count` closed shells that point outward.
inline void ExpectClosedParts(const TriangleMesh& mesh, std::size_t count) {
  const std::vector<TriangleMesh> parts = PartsOf(mesh);
  EXPECT_EQ(parts.size(), count);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_TRUE(IsClosed(parts[i])) << "part " << i;
    EXPECT_GT(SignedVolume(parts[i]), 0) << "part " << i;
  }
}

inline double LongestEdge(const TriangleMesh& mesh) {
  double longest = 0;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const Vec3 edge = mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]];
      longest = std::max(longest, edge.norm());
    }
  }
  return longest;
}

inline double AreaOf(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
  return 0.5 * (b - a).cross(c - a).norm();
}

/// What rays can be cast at, and pictures be made of: not too many triangles, none too long or
/// thin.
inline void ExpectGoodTriangles(const TriangleMesh& mesh, double max_edge_m) {
  EXPECT_LT(mesh.triangles.size(), 60000u);
  EXPECT_LE(LongestEdge(mesh), max_edge_m);
  for (const auto& t : mesh.triangles) ASSERT_GT(AreaOf(mesh, t), 1e-9);
}

}  // namespace vog
