#pragma once

#include <cstdint>

#include "lib/geometry/lane_walk.h"
#include "lib/geometry/voxel_grid.h"

namespace vog {

/// Walks up to eight rays side by side: of each the voxels of WalkVoxels() with the same entries,
/// to the last bit and in their order, but without the branches that a processor cannot foresee.
class ViewWalk {
 public:
  static constexpr int kLanes = WalkLanes::kLanes;
  static constexpr int kRound = 8;  ///< Voxels of each ray at a time.

  /// A voxel in one number: 21 bits of each coordinate, x lowest, counted from kOrigin.
  using PackedKey = std::int64_t;
  static constexpr int kBits = 21;
  static constexpr PackedKey kOrigin = PackedKey{1} << (kBits - 1);

  static PackedKey Pack(const VoxelKey& key) {
    return (key.x + kOrigin) | (key.y + kOrigin) << kBits | (key.z + kOrigin) << (2 * kBits);
  }
  static VoxelKey Unpack(PackedKey packed) {
    constexpr PackedKey kMask = (PackedKey{1} << kBits) - 1;
    const auto coordinate = [&](int axis) {
      return static_cast<std::int32_t>((packed >> (axis * kBits) & kMask) - kOrigin);
    };
    return {coordinate(0), coordinate(1), coordinate(2)};
  }

  /// The next voxels of all rays.
  struct alignas(32) Round {
    WalkLanes::Integers key[kRound];       ///< Packed.
    WalkLanes::Doubles entered_m[kRound];  ///< Not a number once the ray has ended.
  };

  /// Whether rays of `length_m` from `origin` stay where voxels can be packed.
  static bool Holds(const VoxelGrid& grid, const Vec3& origin, double length_m);

  /// @pre Supports(form).
  explicit ViewWalk(const VoxelGrid& grid, WalkForm form = FastestWalkForm());

  /// Ends all rays.
  void Clear();
  /// Puts a ray into a lane. @pre Holds(grid, origin, length_m); `direction` is a unit vector.
  void Start(int lane, const Vec3& origin, const Vec3& direction, double length_m);
  const Round& Next();

 private:
  struct alignas(32) Lanes : WalkLanes {
    Doubles length_m, entered_m;  // -1 and not a number without a ray.
    Integers key;
  };

  template <int kWidth>
  static void WalkRoundBy(Lanes& lanes, Round& round);
  static void WalkRoundBaseline(Lanes& lanes, Round& round);
  static void WalkRoundAvx2(Lanes& lanes, Round& round);

  VoxelGrid grid_;
  WalkForm form_;
  Lanes lanes_;
  Round round_;
};

}  // namespace vog
