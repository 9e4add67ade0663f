#pragma once

#include <array>
#include <limits>
#include <unordered_map>
#include <vector>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// What most others do with submaps: one global grid, as OctoMap keeps it, into which each closed
/// submap is merged once. The centre of every known voxel is moved into W, and its log-odds are
/// added to those of the voxel there, clamped after each addition, in the order of the submaps'
/// numbers. Clamped sums cannot be taken apart: when a merged submap has moved, or is replaced or
/// removed, the grid is made anew from all of them with the next query.
///
/// The answers are therefore not those of eq. 5: turned by a pose, two voxels of a submap may fall
/// into one of the grid, and none into its neighbour, which stays unknown. LogOddsAt() is that of
/// the voxel that holds the point. The open submap grows with every scan; its part is read as in
/// eq. 5 and added to the answer.
///
/// The grid is a hash of blocks of voxels rather than an octree: nearly as quick to read as
/// VogMap's remembered sums, and quicker to fill than an octree, so that a comparison shows what
/// merging costs and not what the container does.
class IncrementalMergeMap final : public SubmapMap {
 public:
  IncrementalMergeMap(double voxel_size_m, const SensorModel& model)
      : SubmapMap(voxel_size_m, model) {}

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;

 private:
  using Block = std::array<LogOddsUnits, BrickGrid::kBrickVoxels>;
  static constexpr SubmapId kNone = std::numeric_limits<SubmapId>::min();

  void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) override;
  void OnOpenChange() override {}
  void MergeNew() const;
  void Merge(const PlacedSubmap& placed) const;
  LogOddsUnits& At(const VoxelKey& voxel) const;
  LogOddsUnits Get(const VoxelKey& voxel) const;
  float LogOddsAt(const VoxelKey& voxel, const Vec3& p_W) const;

  mutable std::unordered_map<VoxelKey, Block> blocks_;
  mutable SubmapId last_merged_ = kNone;  // The submaps up to this number are in the blocks.
};

}  // namespace vog
