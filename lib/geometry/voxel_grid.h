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
  struct Axis {
    std::int32_t step;
    double next_m, delta_m;
  };
  VoxelKey key = grid.KeyOf(origin);
  const auto start = [&](int axis, std::int32_t index) {
    const double border = (index + (direction[axis] > 0 ? 1 : 0)) * grid.voxel_size_m();
    const bool moves = direction[axis] != 0;
    return Axis{
        direction[axis] > 0 ? 1 : -1,
        moves ? (border - origin[axis]) / direction[axis] : std::numeric_limits<double>::max(),
        moves ? grid.voxel_size_m() / std::abs(direction[axis]) : 0};
  };
  Axis x = start(0, key.x), y = start(1, key.y), z = start(2, key.z);
  double entered_m = 0;
  const auto advance = [&entered_m](Axis& axis, std::int32_t& index) {
    entered_m = axis.next_m;
    axis.next_m += axis.delta_m;
    index += axis.step;
  };
  while (visit(key, entered_m)) {
    if (x.next_m < y.next_m && x.next_m < z.next_m) {
      advance(x, key.x);
    } else if (!(x.next_m < y.next_m) && y.next_m < z.next_m) {
      advance(y, key.y);
    } else {
      advance(z, key.z);
    }
    if (entered_m > length_m) return;
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
