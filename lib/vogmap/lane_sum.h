#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// The sum of eq. 5 at one voxel's centre before it is clamped, and the number of submaps in it.
struct VoxelSum {
  void Add(LogOddsUnits part, std::int32_t sign) {
    units += sign * part;
    observers += sign;
  }

  std::int32_t units = 0;
  std::int32_t observers = 0;
};

inline constexpr int kLanes = 8;
inline constexpr int kBlockBits = 3;
inline constexpr std::int32_t kBlockSide = 1 << kBlockBits;  ///< Voxels of W along a block.
inline constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

/// Eight submaps side by side: enough of them to tell which may know a voxel of a block.
class SubmapLanes {
 public:
  SubmapLanes();

  /// Fills a lane, or empties it with nullptr. `voxel_size_m` is that of W's grid. `sign`: 1, or -1
  /// for a submap that is to be taken out of sums.
  void Set(int lane, const PlacedSubmap* submap, double voxel_size_m, std::int32_t sign = 1);

  /// A bit for each lane whose submap may know a voxel of a block with the middle `middle_W`
  /// [voxels of W]: those that it leaves out do not.
  unsigned MayKnow(const std::array<float, 3>& middle_W) const;

  const PlacedSubmap* placed(int lane) const { return placed_[static_cast<std::size_t>(lane)]; }
  std::int32_t sign(int lane) const { return sign_[static_cast<std::size_t>(lane)]; }

 private:
  /// X_MW row by row [voxels of M], and where the middle of a block must lie in M, a little
  /// widened.
  alignas(32) std::array<std::array<float, kLanes>, 9> R_MW_{};
  alignas(32) std::array<std::array<float, kLanes>, 3> p_MW_{}, min_M_{}, max_M_{};
  std::array<const PlacedSubmap*, kLanes> placed_{};  // nullptr where a lane is empty.
  std::array<std::int32_t, kLanes> sign_{};
};

/// Eight submaps that may know a voxel of a block, with all that it takes to sum them. The centre
/// of the block's first voxel is in voxel `voxel_M` of the submap, counted from the corner of its
/// table, at the place `within` (0..1) along each axis. An empty lane is far outside its table.
struct CandidateLanes {
  CandidateLanes();
  void Set(int lane, const PlacedSubmap& submap, std::int32_t of_sign, const VoxelGrid& grid,
           const Vec3& first_M);

  /// Row by row, in voxels of M a voxel of W.
  alignas(32) std::array<std::array<float, kLanes>, 9> R_MW{};
  alignas(32) std::array<std::array<float, kLanes>, 3> within;
  alignas(32) std::array<std::array<std::int32_t, kLanes>, 3> voxel_M;
  /// Bricks of the submap's table along each axis, less one.
  alignas(32) std::array<std::array<std::int32_t, kLanes>, 3> last_brick{};
  alignas(32) std::array<std::int32_t, kLanes> sign{};
  alignas(32) std::array<const std::uint16_t*, kLanes> table{};
  alignas(32) std::array<const LogOddsUnits*, kLanes> values{};
  std::array<const PlacedSubmap*, kLanes> placed{};
};

/// All submaps that may know a voxel of `block`: those with a brick near it.
std::vector<CandidateLanes> CandidatesOf(const std::vector<SubmapLanes>& submaps,
                                         const VoxelGrid& grid, const VoxelKey& block);

/// Where voxel `index` of a block is in it (0..7 along each axis): x counts first, then y, then z.
constexpr VoxelKey OffsetInBlock(int index) {
  constexpr int kMask = kBlockSide - 1;
  return {index & kMask, index >> kBlockBits & kMask, index >> (2 * kBlockBits)};
}

/// Sums the submaps' log-odds at the centres of some voxels of `block`, and their numbers; those
/// with sign -1 are taken away. `voxels`: indices as OffsetInBlock()'s, each once; `sums` gets as
/// many. Each submap is read once for all voxels: many at once cost far less than one by one where
/// the submaps are more than the processor's caches hold.
///
/// The answers are those of the plain double arithmetic of VoxelGrid::KeyOf(X_MW * center_W), bit
/// for bit: places are computed in float, and those that come too near to a voxel's border for
/// float to tell are computed again in double. So forms with and without wide instructions agree.
void SumCandidates(const std::vector<CandidateLanes>& candidates, const VoxelGrid& grid,
                   const VoxelKey& block, std::span<const int> voxels, std::span<VoxelSum> sums);

/// Whether SumCandidates() may use wide instructions (AVX2, FMA) where the machine has them: the
/// default. Tests and benchmarks turn them off.
void AllowWideInstructions(bool allow);

}  // namespace vog
