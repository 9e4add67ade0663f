#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lib/collision/collision_checker.h"
#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// Headings that are told apart where a vehicle stands: number h is the yaw h * 2 pi / 16.
inline constexpr int kHeadings = 16;
double YawOfHeading(int heading);
int HeadingOfYaw(double yaw_rad);

/// A set of headings, one bit each.
using HeadingSet = std::uint32_t;
inline constexpr HeadingSet kAllHeadings = (1u << kHeadings) - 1;
/// The headings that can be turned to from `heading` without leaving `set`; none if it is not in.
HeadingSet ArcAround(HeadingSet set, int heading);
/// The member of `set` nearest to `yaw_rad`. @pre set != 0.
int NearestHeading(HeadingSet set, double yaw_rad);

/// Where the vehicle's box fits, on a lattice of places that fills the exploration box: a picture
/// of the map, drawn anew for each plan where the map has changed. Rounded to voxels, so that what
/// is planned on it is still to be tested by the CollisionChecker whose rules it follows.
///
/// Cost: a read of the voxels that changed, a pass over all voxels, then some microseconds a place
/// that is asked for.
class FreePlaces {
 public:
  /// Places lie `spacing_m` apart, rounded to voxels, farther where there would be too many.
  FreePlaces(const CollisionRules& rules, const Eigen::AlignedBox3d& box_W, double spacing_m);

  /// @pre the checker's clearances are not larger than those of the rules before, and all calls are
  /// about one map.
  void Update(const OccupancyMap& map, const CollisionChecker& checker);

  /// All of these: @pre Update() was called once.
  int places() const { return count_[0] * count_[1] * count_[2]; }
  double spacing_m() const { return spacing_m_; }
  Vec3 PositionOf(int place) const;
  /// Places no farther than `radius_m` on each axis, ascending.
  std::vector<int> PlacesAround(const Vec3& p_W, double radius_m) const;
  /// Neighbours on the lattice, those across an edge of a lattice cell included.
  void NeighboursOf(int place, std::vector<int>& neighbours) const;
  /// Whether a neighbour of the voxel is occupied: its surface may go on there.
  bool IsNextToOccupied(const VoxelKey& key) const {
    return voxels_.Contains(key) && is_next_to_occupied_[voxels_.IndexOf(key)] != 0;
  }
  /// The headings at which the box fits at a place, clearances included.
  HeadingSet HeadingsAt(int place) const;

 private:
  enum State : std::uint8_t { kFree, kUnknown, kOccupied };
  /// Voxels of a row, relative to the middle, that a turned box touches.
  struct Span {
    int dy, dx_min, dx_max;
  };
  using Footprint = std::vector<Span>;
  struct Occupied {
    VoxelKey key;
    float reach_voxels;  ///< By which it may lie elsewhere.
  };
  /// What a vehicle at one height could touch, seen from above: of each row, how many voxels left
  /// of a column are occupied, or unknown.
  struct Level {
    std::vector<std::uint16_t> occupied_before, unknown_before;
  };

  void Measure(const VoxelGrid& grid);
  Footprint FootprintOf(const CollisionRules& rules, double clearance_m, double yaw_rad) const;
  static Footprint UnionOf(std::span<const Footprint> footprints);
  void SetRules(const CollisionRules& rules);
  void ReadChanges(const OccupancyMap& map, const CollisionChecker& checker);
  void Read(const OccupancyMap& map, const CollisionChecker& checker, const VoxelBox& box);
  /// What the map says is there inside the vehicle's hull, and unknown water around the starts.
  void FreeWhatTheCheckerFrees(const CollisionChecker& checker, const Eigen::AlignedBox3d& bounds_W,
                               const VoxelBox& box);
  void FindOccupied(const OccupancyMap& map, const CollisionRules& rules);
  void MarkNeighbours();
  void DrawLevel(int level);
  bool IsClear(const Footprint& footprint, const std::vector<std::uint16_t>& before, int x,
               int y) const;
  VoxelKey VoxelOf(int place) const;

  CollisionRules rules_;
  Eigen::AlignedBox3d box_W_;
  double wanted_spacing_m_, spacing_m_ = 0;
  std::optional<VoxelGrid> grid_;
  VoxelBox voxels_;  // All that a vehicle in the box could touch.
  VoxelKey first_;   // Of the lattice.
  int step_ = 1;     // Of the lattice [voxels].
  std::array<int, 3> count_ = {0, 0, 0};
  int occupied_layers_ = 0, unknown_layers_ = 0;  // Above and below a vehicle's middle.
  std::array<Footprint, kHeadings / 2> near_occupied_, near_unknown_;
  Footprint turning_near_occupied_, turning_near_unknown_;  // Those of all headings.

  std::vector<State> states_;
  std::vector<Occupied> occupied_;  // By height.
  std::vector<std::uint8_t> is_next_to_occupied_;
  std::vector<VoxelBox> keep_out_;
  std::vector<Level> levels_;
  std::int64_t revision_ = -1;
  Eigen::AlignedBox3d hidden_W_;  // Where the vehicle hid what the map says.
  std::vector<FreeBubble> bubbles_;
  std::vector<float> log_odds_;  // Scratch.
  mutable std::vector<HeadingSet> headings_;
  mutable std::vector<bool> has_headings_;
};

}  // namespace vog
