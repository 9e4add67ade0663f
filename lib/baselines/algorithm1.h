#pragma once

#include <octomap/OcTree.h>

#include <map>
#include <memory>
#include <vector>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// The paper's algorithm 1 to the letter, on one octree a submap: the reference for tests and
/// benchmarks, and the planner that the paper timed. Unlike eq. 5 it clamps after every addition,
/// in the order of the submaps' numbers. The open submap is the last one; its octree is made anew
/// when it has grown and somebody asks.
class Algorithm1Map final : public SubmapMap {
 public:
  Algorithm1Map(double voxel_size_m, const SensorModel& model);

  /// Algorithm 1 as printed: the probabilities of occupancy at c + k * step * v for k = 1 .. steps,
  /// 0.5 where no submap has a voxel. `direction_W` is v, a unit vector.
  std::vector<double> OccupancyAlong(const Vec3& origin_W, const Vec3& direction_W, double step_m,
                                     int steps) const;

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;

 private:
  /// A submap as the algorithm sees it.
  struct Octree {
    std::unique_ptr<octomap::OcTree> tree;
    Eigen::AlignedBox3d box_M;
    Pose3 X_MW = Pose3::Identity();
  };
  using Octrees = std::vector<const Octree*>;

  static Octree ToOctree(const BrickGrid& grid, const Pose3& X_MW);
  void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) override;
  void OnOpenChange() override { open_octree_.tree.reset(); }
  const Octree& OpenOctree() const;
  template <class Extent>
  Octrees OctreesIn(const Extent& extent) const;
  float LogOddsAt(const Octrees& octrees, const Vec3& p_W) const;

  float min_, max_;  // Log-odds.
  std::map<SubmapId, Octree> octrees_;
  mutable Octree open_octree_;  // Without a tree until it is asked for.
};

}  // namespace vog
