#pragma once

#include <vector>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// Eq. 5 with nothing remembered: at each asked place, the log-odds of all submaps that know it and
/// of the open one are added, and the sum is clamped. The same answers as VogMap's, bit for bit.
class DirectMap final : public SubmapMap {
 public:
  DirectMap(double voxel_size_m, const SensorModel& model) : SubmapMap(voxel_size_m, model) {}

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;

 private:
  using Submaps = std::vector<const PlacedSubmap*>;

  void OnChange(SubmapId, const PlacedSubmap*, const PlacedSubmap*) override {}
  void OnOpenChange() override {}
  template <class Extent>
  Submaps SubmapsIn(const Extent& extent) const;
  float LogOddsAt(const Submaps& submaps, const Vec3& p_W) const;
};

}  // namespace vog
