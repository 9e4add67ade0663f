#include "lib/baselines/incremental_merge.h"

#include "lib/vogmap/log_odds_sum.h"

namespace vog {
namespace {

VoxelKey BlockOf(const VoxelKey& voxel) {
  return {voxel.x >> BrickGrid::kBrickBits, voxel.y >> BrickGrid::kBrickBits,
          voxel.z >> BrickGrid::kBrickBits};
}

}  // namespace

void IncrementalMergeMap::OnChange(SubmapId id, const PlacedSubmap*, const PlacedSubmap*) {
  if (id > last_merged_) return;
  blocks_.clear();
  last_merged_ = kNone;
}

void IncrementalMergeMap::MergeNew() const {
  for (auto next = placed().upper_bound(last_merged_); next != placed().end(); ++next) {
    Merge(next->second);
    last_merged_ = next->first;
  }
}

void IncrementalMergeMap::Merge(const PlacedSubmap& placed) const {
  const BrickGrid& from = placed.submap->grid;
  from.ForEach([&](const VoxelKey& voxel, LogOddsUnits units) {
    LogOddsUnits& merged = At(grid().KeyOf(placed.X_WM * from.grid().CenterOf(voxel)));
    const int before = merged == kUnknownUnits ? 0 : merged;
    merged = static_cast<LogOddsUnits>(model().Clamp(before + units));
  });
}

LogOddsUnits& IncrementalMergeMap::At(const VoxelKey& voxel) const {
  const auto [block, is_new] = blocks_.try_emplace(BlockOf(voxel));
  if (is_new) block->second.fill(kUnknownUnits);
  return block->second[BrickGrid::IndexInBrick(voxel)];
}

LogOddsUnits IncrementalMergeMap::Get(const VoxelKey& voxel) const {
  const auto block = blocks_.find(BlockOf(voxel));
  return block == blocks_.end() ? kUnknownUnits : block->second[BrickGrid::IndexInBrick(voxel)];
}

float IncrementalMergeMap::LogOddsAt(const VoxelKey& voxel, const Vec3& p_W) const {
  LogOddsSum sum;
  sum.Add(Get(voxel));
  if (open() != nullptr) sum.Add(open()->Get(open()->grid().KeyOf(X_open_W() * p_W)));
  return sum.Clamped(model());
}

void IncrementalMergeMap::LogOddsAt(std::span<const Vec3> points_W,
                                    std::span<float> log_odds) const {
  MergeNew();
  for (std::size_t i = 0; i < points_W.size(); ++i)
    log_odds[i] = LogOddsAt(grid().KeyOf(points_W[i]), points_W[i]);
}

void IncrementalMergeMap::LogOddsOf(std::span<const VoxelKey> voxels,
                                    std::span<float> log_odds) const {
  MergeNew();
  ReadVoxels(voxels, log_odds,
             [this](const VoxelKey& voxel) { return LogOddsAt(voxel, grid().CenterOf(voxel)); });
}

void IncrementalMergeMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  MergeNew();
  ReadBox(box, log_odds,
          [this](const VoxelKey& voxel) { return LogOddsAt(voxel, grid().CenterOf(voxel)); });
}

void IncrementalMergeMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                                  std::vector<RayVoxel>& ray) const {
  MergeNew();
  WalkRay(origin_W, direction_W, range_m, ray,
          [this](const VoxelKey& voxel) { return LogOddsAt(voxel, grid().CenterOf(voxel)); });
}

}  // namespace vog
