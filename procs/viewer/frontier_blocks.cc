#include "procs/viewer/frontier_blocks.h"

#include <algorithm>

#include "lib/occupancy/frontiers.h"

namespace vog {
namespace {

std::int32_t BlockOf(std::int32_t index) {
  return index >= 0 ? index / FrontierBlocks::kSide : -((-index - 1) / FrontierBlocks::kSide) - 1;
}

VoxelKey BlockOf(const VoxelKey& key) { return {BlockOf(key.x), BlockOf(key.y), BlockOf(key.z)}; }

}  // namespace

FrontierBlocks::FrontierBlocks(const OccupancyMap& map, const Eigen::AlignedBox3d& box_W)
    : map_(map), box_(VoxelsOf(map.grid(), box_W)) {}

void FrontierBlocks::NoteChanged(const Eigen::AlignedBox3d& box_W) {
  if (box_W.isEmpty()) return;
  VoxelBox changed = VoxelsOf(map_.grid(), box_W);
  // A neighbour's frontier may end with it.
  for (std::int32_t* index : {&changed.min.x, &changed.min.y, &changed.min.z}) --*index;
  for (std::int32_t* index : {&changed.max.x, &changed.max.y, &changed.max.z}) ++*index;
  changed = Intersection(changed, box_);
  if (changed.IsEmpty()) return;
  ForEachVoxel({BlockOf(changed.min), BlockOf(changed.max)},
               [&](const VoxelKey& block) { waiting_.insert(block); });
}

void FrontierBlocks::NoteChanges() {
  const auto changes = map_.ChangedSince(revision_);
  revision_ = map_.revision();
  if (changes) {
    for (const Eigen::AlignedBox3d& box_W : *changes) NoteChanged(box_W);
  } else {
    NoteChanged({map_.grid().CenterOf(box_.min), map_.grid().CenterOf(box_.max)});
  }
}

std::vector<FrontierBlocks::Block> FrontierBlocks::Update(int max_blocks) {
  if (revision_ != map_.revision()) NoteChanges();
  std::vector<Block> changed;
  for (int i = 0; i < max_blocks && !waiting_.empty(); ++i) {
    const VoxelKey block = *waiting_.begin();
    waiting_.erase(waiting_.begin());
    const VoxelKey corner{block.x * kSide, block.y * kSide, block.z * kSide};
    const VoxelBox voxels = Intersection(
        {corner, {corner.x + kSide - 1, corner.y + kSide - 1, corner.z + kSide - 1}}, box_);
    std::vector<VoxelKey> frontiers = FrontiersIn(map_, voxels);
    std::vector<VoxelKey>& known = known_[block];
    if (frontiers == known) continue;
    known = frontiers;
    changed.push_back({corner, std::move(frontiers)});
  }
  return changed;
}

}  // namespace vog
