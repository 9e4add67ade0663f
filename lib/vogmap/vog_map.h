#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// A global occupancy grid that is never merged: submaps m_i at poses X_WMi, eq. 1. The answer at a
/// point, eq. 5, is
///
///   L(p_W) = clamp( sum_i L_i(X_WMi^-1 * p_W) )
///
/// over the submaps that observed the point, clamped once; where none did it is unknown. Sums are
/// of whole units, so that their order does not matter. Moving a submap therefore costs nothing
/// until somebody asks.
///
/// LogOddsAt() evaluates the points themselves (`direct`). The other queries evaluate the centres
/// of global voxels and remember the sum over the closed submaps until one is added, moved or
/// removed
/// (`cached`): bit for bit what LogOddsAt() says there. The open submap's part is never remembered,
/// so that it may grow at any time.
class VogMap final : public SubmapMap {
 public:
  VogMap(double voxel_size_m, const SensorModel& model);
  ~VogMap() override;
  VogMap(VogMap&&) noexcept;

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;
  void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const override;

  /// Gives the memory of remembered sums back; the answers stay.
  void ReleaseCache() const;

 private:
  struct Block;

  void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) override;
  void OnOpenChange() override {}
  std::int32_t SumAt(std::span<const PlacedSubmap* const> candidates, const Vec3& p_W) const;
  float WithOpen(std::int32_t closed_sum, const Vec3& p_W) const;
  Block& BlockOf(const VoxelKey& voxel) const;
  std::vector<const PlacedSubmap*> CandidatesFor(const VoxelKey& block) const;
  float Evaluate(Block& block, int index, const VoxelKey& voxel) const;
  float LogOddsOfVoxel(const VoxelKey& voxel) const;

  mutable std::unordered_map<VoxelKey, std::unique_ptr<Block>> blocks_;
  mutable VoxelKey last_block_key_;
  mutable Block* last_block_ = nullptr;
};

}  // namespace vog
