#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// The frontier voxels of a map in a box, in blocks, kept up to date a few blocks at a time.
class FrontierBlocks {
 public:
  static constexpr std::int32_t kSide = 16;  ///< Of a block [voxels].

  struct Block {
    VoxelKey corner;
    std::vector<VoxelKey> frontiers;
  };

  /// `map` must outlive it.
  FrontierBlocks(const OccupancyMap& map, const Eigen::AlignedBox3d& box_W);

  /// Looks at up to `max_blocks` of those that may have changed; returns the ones that did.
  std::vector<Block> Update(int max_blocks);

  /// Whether all that has changed was looked at.
  bool IsUpToDate() const { return waiting_.empty() && revision_ == map_.revision(); }

 private:
  void NoteChanges();
  void NoteChanged(const Eigen::AlignedBox3d& box_W);

  const OccupancyMap& map_;
  VoxelBox box_;
  std::int64_t revision_ = -1;  // Of the map, up to which changes are noted.
  std::set<VoxelKey> waiting_;  // Blocks to look at, by number.
  std::map<VoxelKey, std::vector<VoxelKey>> known_;
};

}  // namespace vog
