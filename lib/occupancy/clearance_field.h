#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// Distances to the nearest voxel that is not free, up to a cap: how much room there is. Distances
/// are remembered; when the map changes, only those near a change are forgotten.
class ClearanceField {
 public:
  enum class Obstacles { kOccupied, kOccupiedAndUnknown };

  /// `map` must outlive the field. @pre max_m > 0.
  ClearanceField(const OccupancyMap& map, double max_m, Obstacles obstacles);

  /// From the centre of `voxel` to the nearest point of an obstacle's cube [m]; 0 inside one, max_m
  /// where none is nearer. A new one costs a read of the box of max_m around it.
  double DistanceFrom(const VoxelKey& voxel);

  /// Distances that are remembered.
  std::size_t remembered() const { return distance_m_.size(); }

 private:
  void ForgetWhatChanged();
  double Measure(const VoxelKey& voxel);

  const OccupancyMap& map_;
  double max_m_;
  Obstacles obstacles_;
  std::int64_t revision_;
  std::unordered_map<VoxelKey, double> distance_m_;  // Is never iterated to a result.
  std::vector<VoxelAnswer> not_free_;                // Scratch.
};

}  // namespace vog
