#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "lib/geometry/waypoint.h"
#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// What the vehicle may not touch.
struct CollisionRules {
  Vec3 hull_size_m = {1.0, 1.0, 0.5};
  double clearance_m = 0.1;          ///< Kept from occupied voxels, on all sides.
  double unknown_clearance_m = 0.0;  ///< Kept from unknown ones, where they block.
  bool unknown_blocks = true;
};

/// A ball in W whose unknown voxels are taken for free.
struct FreeBubble {
  Vec3 center_W_m = Vec3::Zero();
  double radius_m = 0;
};

/// Tests the vehicle's box against a map. The voxels that matter are handed to FCL one by one,
/// unknown ones too: given a whole octree, FCL takes absent cells for free.
class CollisionChecker {
 public:
  explicit CollisionChecker(const CollisionRules& rules);
  ~CollisionChecker();

  void SetBubble(const FreeBubble& bubble) { bubble_ = bubble; }
  const CollisionRules& rules() const { return rules_; }

  /// Whether the box, grown by the clearances, is free at `at`. `extra_m` is added to the clearance
  /// from occupied voxels; it may be negative.
  bool IsFree(const OccupancyMap& map, const Waypoint& at, double extra_m = 0) const;

  /// Whether it is free all the way, sampled so densely that no corner moves more than half a voxel
  /// between two samples. Cost: one read of the voxels around the edge, then FCL on those that
  /// block.
  bool IsEdgeFree(const OccupancyMap& map, const Waypoint& from, const Waypoint& to,
                  double extra_m = 0) const;

  /// The free part of the edge from its start, as a fraction 0..1 of its length.
  double FreeFractionOf(const OccupancyMap& map, const Waypoint& from, const Waypoint& to,
                        double extra_m = 0) const;

 private:
  struct Obstacle {
    Vec3 center_W_m;
    bool is_occupied;
  };

  Eigen::AlignedBox3d SweptBounds(const Waypoint& from, const Waypoint& to, double extra_m) const;
  void FindObstacles(const OccupancyMap& map, const Eigen::AlignedBox3d& bounds_W,
                     std::vector<Obstacle>& obstacles) const;
  bool Touches(const Waypoint& at, const std::vector<Obstacle>& obstacles, double voxel_size_m,
               double extra_m) const;
  int SamplesOf(const OccupancyMap& map, const Waypoint& from, const Waypoint& to) const;

  CollisionRules rules_;
  FreeBubble bubble_;
  mutable std::vector<float> log_odds_;  // Scratch.
  mutable std::vector<Obstacle> obstacles_;
};

}  // namespace vog
