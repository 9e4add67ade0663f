#pragma once

#include <octomap/OcTree.h>

#include <map>
#include <memory>
#include <vector>

#include "lib/occupancy/occupancy_map.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// The paper's algorithm 1 to the letter, on one octree a submap: the reference for tests and
/// benchmarks, and the planner that the paper timed. Unlike eq. 5 it clamps after every addition.
class Algorithm1Map final : public OccupancyMap {
 public:
  Algorithm1Map(double voxel_size_m, const SensorModel& model);

  void Place(const SubmapPtr& submap, const Pose3& X_WM);

  /// Algorithm 1 as printed: the probabilities of occupancy at c + k * step * v for k = 1 .. steps,
  /// 0.5 where no submap has a voxel. `direction_W` is v, a unit vector.
  std::vector<double> OccupancyAlong(const Vec3& origin_W, const Vec3& direction_W, double step_m,
                                     int steps) const;

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;
  std::int64_t revision() const override { return revision_; }

 private:
  struct Placed {
    std::unique_ptr<octomap::OcTree> tree;
    Eigen::AlignedBox3d box_M;
    Pose3 X_WM, X_MW;
  };

  std::vector<const Placed*> AllSubmaps() const;
  std::vector<const Placed*> IntersectingSubmaps(const Vec3& origin_W, const Vec3& direction_W,
                                                 double length_m, double margin_m) const;
  float LogOddsAt(const std::vector<const Placed*>& submaps, const Vec3& p_W) const;

  float min_, max_;  // Log-odds.
  std::map<SubmapId, Placed> placed_;
  std::int64_t revision_ = 0;
};

}  // namespace vog
