#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>

#include "lib/geometry/pose.h"

namespace vog {

/// A voxel's number along each axis; voxel (0, 0, 0) has a corner at the origin.
struct VoxelKey {
  std::int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const VoxelKey&) const = default;
};

/// A cube of space divided into voxels. Keys agree with OctoMap's at the same resolution.
class VoxelGrid {
 public:
  /// @pre voxel_size_m > 0.
  explicit VoxelGrid(double voxel_size_m)
      : voxel_size_m_(voxel_size_m), voxels_per_m_(1 / voxel_size_m) {}

  double voxel_size_m() const { return voxel_size_m_; }

  VoxelKey KeyOf(const Vec3& p) const { return {Index(p.x()), Index(p.y()), Index(p.z())}; }
  Vec3 CenterOf(const VoxelKey& key) const { return {Center(key.x), Center(key.y), Center(key.z)}; }

 private:
  std::int32_t Index(double coordinate) const {
    // Rounds down; std::floor is a call where the instruction set has none.
    const double voxels = voxels_per_m_ * coordinate;
    const auto whole = static_cast<std::int64_t>(voxels);
    return static_cast<std::int32_t>(whole - (static_cast<double>(whole) > voxels));
  }
  double Center(std::int32_t index) const { return (index + 0.5) * voxel_size_m_; }

  double voxel_size_m_, voxels_per_m_;
};

/// Walks the voxels that the segment of `length_m` from `origin` along the unit vector `direction`
/// crosses, in order, the first and the last included [Amanatides and Woo 1987]. Calls
/// `visit(key, distance at which the segment enters it)` until that returns false.
template <class Visit>
void WalkVoxels(const VoxelGrid& grid, const Vec3& origin, const Vec3& direction, double length_m,
                Visit visit) {
  // What a step along each axis adds: tables, because which axis is next cannot be predicted.
  struct Step {
    std::int32_t key[3] = {0, 0, 0};
    double next_m[3] = {0, 0, 0};
  };
  Step steps[3];
  VoxelKey key = grid.KeyOf(origin);
  const std::int32_t start[3] = {key.x, key.y, key.z};
  double next_m[3];
  for (int i = 0; i < 3; ++i) {
    steps[i].key[i] = direction[i] > 0 ? 1 : -1;
    const double border = (start[i] + (direction[i] > 0 ? 1 : 0)) * grid.voxel_size_m();
    const bool moves = direction[i] != 0;
    next_m[i] = moves ? (border - origin[i]) / direction[i] : std::numeric_limits<double>::max();
    steps[i].next_m[i] = moves ? grid.voxel_size_m() / std::abs(direction[i]) : 0;
  }
  double x_m = next_m[0], y_m = next_m[1], z_m = next_m[2], entered_m = 0;
  while (visit(key, entered_m)) {
    const int xy = x_m < y_m ? 0 : 1;
    const double xy_m = x_m < y_m ? x_m : y_m;
    const int axis = xy_m < z_m ? xy : 2;
    entered_m = xy_m < z_m ? xy_m : z_m;
    if (entered_m > length_m) return;
    const Step& step = steps[axis];
    key = {key.x + step.key[0], key.y + step.key[1], key.z + step.key[2]};
    x_m += step.next_m[0];
    y_m += step.next_m[1];
    z_m += step.next_m[2];
  }
}

}  // namespace vog

template <>
struct std::hash<vog::VoxelKey> {
  std::size_t operator()(const vog::VoxelKey& key) const noexcept {
    const auto bits = [](std::int32_t index) {
      return static_cast<std::uint64_t>(index) & 0x1fffff;
    };
    std::uint64_t h = bits(key.x) | bits(key.y) << 21 | bits(key.z) << 42;
    h = (h ^ (h >> 32)) * 0x9e3779b97f4a7c15u;
    return h ^ (h >> 29);
  }
};
