#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// Marks voxels of a box, so that each counts once.
class VoxelMarks {
 public:
  /// Forgets all marks. Cost: next to nothing while boxes do not grow.
  void Begin(const VoxelBox& box) {
    const bool fits = box.count() <= stamps_.size();
    if (!fits || ++stamp_ == 0) {
      stamps_.assign(std::max(box.count(), stamps_.size()), 0);
      stamp_ = 1;
    }
    box_ = box;
  }
  /// Whether the voxel is in the box and was not marked; it is now.
  bool Mark(const VoxelKey& key) {
    if (!box_.Contains(key)) return false;
    std::uint32_t& stamp = stamps_[box_.IndexOf(key)];
    if (stamp == stamp_) return false;
    stamp = stamp_;
    return true;
  }

 private:
  VoxelBox box_;
  std::vector<std::uint32_t> stamps_;
  std::uint32_t stamp_ = 0;
};

}  // namespace vog
