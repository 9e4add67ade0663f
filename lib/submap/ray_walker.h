#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "lib/geometry/lane_walk.h"
#include "lib/geometry/voxel_grid.h"

namespace vog {

/// A way from one point to another [m], in floats as OctoMap holds them.
struct Ray {
  Eigen::Vector3f from, to;
};

/// Finds the voxels that the rays of a scan pass: of each ray those that OctoMap's computeRayKeys
/// tells [Amanatides and Woo 1987], to the last bit. That is all from its first voxel up to the one
/// before its last; none of a ray within one voxel or with an end beyond OctoMap's 2^16 keys.
class RayWalker {
 public:
  /// @pre Supports(form).
  explicit RayWalker(double voxel_size_m, WalkForm form = FastestWalkForm());

  /// The voxel that holds `point`, if OctoMap has a key for it.
  std::optional<VoxelKey> KeyOf(const Eigen::Vector3f& point) const {
    const double x = voxels_per_m_ * point.x(), y = voxels_per_m_ * point.y(),
                 z = voxels_per_m_ * point.z();
    if (!HasKey(x) || !HasKey(y) || !HasKey(z)) return std::nullopt;
    return VoxelKey{Floor(x), Floor(y), Floor(z)};
  }

  /// Calls `visit(key)` for each voxel that a ray passes, at least once and seldom again; those of
  /// a single ray in their order.
  template <class Visit>
  void Walk(const std::vector<Ray>& rays, Visit visit) {
    Collect(rays);
    for (std::size_t i = 0; i < passed_count_; ++i) visit(Unpack(passed_[i]));
  }

 private:
  /// A key in one number that is linear in x, y and z, so that a step is an addition, and whose low
  /// bits differ between neighbours.
  using PackedKey = std::int64_t;
  static constexpr int kBitsX = 23, kBitsXY = 40;
  static constexpr PackedKey kX = 1, kY = (1 << kBitsX) + 73, kZ = (PackedKey{1} << kBitsXY) + 2659;
  // OctoMap's keys are 0 .. 2^16 - 1; one more, since rounding may lead a walk past its end.
  static constexpr PackedKey kOrigin = (1 << 15) + 1;

  static PackedKey Pack(const VoxelKey& key) {
    return kX * (key.x + kOrigin) + kY * (key.y + kOrigin) + kZ * (key.z + kOrigin);
  }
  static VoxelKey Unpack(PackedKey packed) {
    const PackedKey z = packed >> kBitsXY, xy = packed - z * kZ;
    const PackedKey y = xy >> kBitsX, x = xy - y * kY;
    // In 16 bits, as OctoMap's keys: past the last comes the first.
    return {static_cast<std::int16_t>(x - kOrigin), static_cast<std::int16_t>(y - kOrigin),
            static_cast<std::int16_t>(z - kOrigin)};
  }

  static constexpr int kLanes = WalkLanes::kLanes;
  static constexpr int kRound = 8;  // Steps of all lanes between two looks at which have ended.

  /// Whether a coordinate in voxels is within OctoMap's 2^16 keys; not a number never is.
  static bool HasKey(double coordinate) { return coordinate >= -32768 && coordinate < 32768; }

  /// Without the call that std::floor is on processors of old.
  static std::int32_t Floor(double coordinate) {
    const auto truncated = static_cast<std::int32_t>(coordinate);
    return truncated - (coordinate < truncated);
  }

  /// As many rays, each at a voxel. Lanes that have ended stay where they are.
  struct alignas(32) Lanes : WalkLanes {
    Doubles length_m;
    Integers key, end;  ///< Packed.
    Integers walks;     ///< All bits of a lane that has not ended.
  };
  /// The voxels of the lanes in the steps of a round.
  struct alignas(32) Trace {
    WalkLanes::Integers keys[kRound];
  };

  void Collect(const std::vector<Ray>& rays);
  bool Start(const Ray& ray, int lane);
  void WalkToEnds();
  void Keep(const Trace& trace);

  template <int kWidth>
  static void WalkRoundBy(Lanes& lanes, Trace& trace);
  static void WalkRoundBaseline(Lanes& lanes, Trace& trace);
  static void WalkRoundAvx2(Lanes& lanes, Trace& trace);

  double voxel_size_m_, voxels_per_m_;
  WalkForm form_;
  Lanes lanes_;
  Trace trace_;
  std::vector<PackedKey> passed_;  // With room for a round beyond passed_count_.
  std::size_t passed_count_ = 0;
  // The last key kept, by its low bits. Neighbouring rays share most of their voxels; this drops
  // nearly all of the repetitions.
  std::vector<PackedKey> recent_;
};

}  // namespace vog
