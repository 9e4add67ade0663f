#pragma once

#include <algorithm>
#include <bitset>
#include <limits>
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
  /// The clearance from an occupied voxel grows sideways by so many standard deviations of its
  /// place.
  double uncertainty_sigmas = 0;
  double max_uncertainty_m = 1;  ///< But not by more than this.
  /// Occupied voxels whose place is less certain than this get a share of the clearance.
  double sure_sigma_m = std::numeric_limits<double>::infinity();
  double unsure_share = 0;

  /// Of the clearance, that an occupied voxel gets whose place is so uncertain.
  double ShareFor(double sigma_m) const { return sigma_m > sure_sigma_m ? unsure_share : 1; }
  /// By which the clearance from it is larger sideways than from a place that is certain.
  double GrowthFor(double sigma_m) const {
    return ShareFor(sigma_m) * std::min(max_uncertainty_m, uncertainty_sigmas * sigma_m);
  }
};

/// A ball in W whose unknown voxels are taken for free: those in an upright cylinder in its middle,
/// and those in directions that were looked into.
struct FreeBubble {
  /// Directions seen from above: number s is yaws from s * 2 pi / 72 on.
  static constexpr int kSectors = 72;
  using Sectors = std::bitset<kSectors>;

  Vec3 center_W_m = Vec3::Zero();
  double radius_m = 0;
  double core_radius_m = std::numeric_limits<double>::infinity();
  Sectors looked = {};

  /// Notes that the directions whose middles are within `beside_rad` of a yaw were looked into.
  void LookInto(double yaw_rad, double beside_rad);
  bool Holds(const Vec3& p_W) const;
  Eigen::AlignedBox3d bounds_W() const {
    return {center_W_m - Vec3::Constant(radius_m), center_W_m + Vec3::Constant(radius_m)};
  }
  bool operator==(const FreeBubble&) const = default;
};

/// Tests the vehicle's box against a map. The voxels that matter are handed to FCL one by one,
/// unknown ones too: given a whole octree, FCL takes absent cells for free.
class CollisionChecker {
 public:
  explicit CollisionChecker(const CollisionRules& rules);
  /// The same rules with all clearances scaled by `share`; 0 leaves the bare hull.
  CollisionChecker Scaled(double share) const;
  /// The same rules, but clearances grow by `share` of what uncertainty asks for; 0: not at all.
  CollisionChecker GrowingBy(double share) const;
  /// The same rules, but from occupied voxels whose place is less certain than `sigma_m` a share of
  /// the clearances is kept, 0: they block the bare hull alone. For a vehicle that the map shows
  /// among them.
  CollisionChecker ForSure(double sigma_m, double unsure_share) const;
  /// The same rules, but unknown voxels are passable.
  CollisionChecker PassingUnknown() const;

  void SetBubble(const FreeBubble& bubble) { bubbles_ = {bubble}; }
  void SetBubbles(std::vector<FreeBubble> bubbles) { bubbles_ = std::move(bubbles); }
  const std::vector<FreeBubble>& bubbles() const { return bubbles_; }
  /// Boxes in W that no part of the vehicle, without clearance, may enter.
  void SetKeepOut(std::vector<Eigen::AlignedBox3d> boxes_W) { keep_out_W_ = std::move(boxes_W); }
  const std::vector<Eigen::AlignedBox3d>& keep_out_W() const { return keep_out_W_; }
  /// Which voxels inside the box at the vehicle's present place are taken for free: unknown ones,
  /// or occupied ones, too. Then what is nearer to the hull there than its clearance need not be
  /// farther away elsewhere, but may not be nearer.
  enum class Presence { kCoversUnknown, kCoversOccupied };
  /// Tells that the vehicle is at `at`: voxels inside its box there, grown by `margin_m`, are free.
  void SetPresence(const Waypoint& at, double margin_m,
                   Presence presence = Presence::kCoversUnknown);
  const CollisionRules& rules() const { return rules_; }
  /// Whether a voxel around `p_W` is taken for free although the map says occupied or unknown.
  bool TakesForFree(bool is_occupied, const Vec3& p_W) const;
  /// Holds all voxels that this is so of for the vehicle's presence.
  Eigen::AlignedBox3d PresenceBounds() const;

  /// Whether the box, grown by the clearances, is free at `at`.
  bool IsFree(const OccupancyMap& map, const Waypoint& at) const;

  /// Whether it is free all the way, sampled so densely that no corner moves more than half a voxel
  /// between two samples. Cost: one read of the voxels around the edge, then FCL on those that
  /// block.
  bool IsEdgeFree(const OccupancyMap& map, const Waypoint& from, const Waypoint& to) const;

  /// Whether all that the bare hull passes on its way, but for where the vehicle is present, was
  /// seen by observations whose place is sure: OccupancyMap::IsSurelyKnown().
  bool IsSurelyKnown(const OccupancyMap& map, const Waypoint& from, const Waypoint& to) const;

  /// The free part of the edge from its start, as a fraction 0..1 of its length.
  double FreeFractionOf(const OccupancyMap& map, const Waypoint& from, const Waypoint& to) const;

 private:
  struct Obstacle {
    Vec3 center_W_m;
    Vec3 clearance_m;  // By which the hull grows on each side.
  };

  Eigen::AlignedBox3d SweptBounds(const OccupancyMap& map, const Waypoint& from,
                                  const Waypoint& to) const;
  bool IsInsideHull(const Vec3& p_W) const;
  void FindObstacles(const OccupancyMap& map, const Eigen::AlignedBox3d& bounds_W) const;
  /// By which the hull grows toward an occupied voxel whose place is so uncertain.
  Vec3 ClearanceFrom(const Vec3& center_W, double sigma_m, double voxel_radius_m) const;
  bool Touches(const Waypoint& at, double voxel_size_m) const;
  bool EntersKeepOut(const Pose3& X_BW) const;
  int SamplesOf(const OccupancyMap& map, const Waypoint& from, const Waypoint& to) const;

  CollisionRules rules_;
  std::vector<FreeBubble> bubbles_;
  std::vector<Eigen::AlignedBox3d> keep_out_W_;
  // The box at the vehicle's present place, in which nothing can be: half its size is 0 before
  // SetPresence().
  Pose3 X_PW_ = Pose3::Identity();
  Vec3 presence_half_m_ = Vec3::Zero();
  Presence presence_ = Presence::kCoversUnknown;
  // Scratch.
  mutable std::vector<VoxelAnswer> not_free_;
  mutable std::vector<float> sigma_m_;
  mutable std::vector<VoxelKey> occupied_;
  mutable std::vector<Obstacle> obstacles_;
};

}  // namespace vog
