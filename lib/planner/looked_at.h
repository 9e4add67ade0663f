#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// How often the vehicle has looked at each voxel of the exploration box while the map did not get
/// to know it. What stays unknown however often one looks cannot be seen, whatever the rays say:
/// returns were lost, or it is thinner than a voxel.
class LookedAt {
 public:
  /// @pre most is 1..255: looks after which there is no more hope.
  LookedAt(const Eigen::AlignedBox3d& box_W, int most) : box_W_(box_W), most_(most) {}

  /// Counts one look at each of `voxels`; one that comes twice is counted twice.
  void Note(const VoxelGrid& grid, const std::vector<VoxelKey>& voxels) {
    if (!voxels_) {
      voxels_ = VoxelsOf(grid, box_W_);
      looks_.assign(voxels_->count(), 0);
    }
    for (const VoxelKey& key : voxels) {
      if (!voxels_->Contains(key)) continue;
      std::uint8_t& looks = looks_[voxels_->IndexOf(key)];
      looks = static_cast<std::uint8_t>(std::min<int>(looks + 1, most_));
    }
  }
  bool IsInVain(const VoxelKey& key) const {
    return voxels_ && voxels_->Contains(key) && looks_[voxels_->IndexOf(key)] >= most_;
  }

 private:
  Eigen::AlignedBox3d box_W_;
  int most_;
  std::optional<VoxelBox> voxels_;
  std::vector<std::uint8_t> looks_;
};

}  // namespace vog
