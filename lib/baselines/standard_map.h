#pragma once

#include <octomap/OcTree.h>

#include <memory>

#include "lib/occupancy/occupancy_map.h"
#include "lib/scan/scan.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// The map that most planners use: one global OctoMap, filled with every scan at its dead-reckoned
/// pose and never corrected. Its frame is the odometry's world O.
class StandardMap final : public OccupancyMap {
 public:
  StandardMap(double voxel_size_m, const SensorModelOptions& model);

  /// Eq. 2-4 with the rules of ScanInserter: a voxel once a scan, hits win, nothing nearer than the
  /// window.
  void Insert(const Scan& scan, const Pose3& X_WB);

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;
  std::int64_t revision() const override { return revision_; }

  const octomap::OcTree& tree() const { return tree_; }

 private:
  float LogOddsOfVoxel(const VoxelKey& voxel) const;

  octomap::OcTree tree_;
  std::int64_t revision_ = 0;
};

}  // namespace vog
