#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lib/base/config.h"
#include "lib/vogmap/submap_map.h"

namespace vog {

/// Table [fuse].
struct FuseOptions {
  bool enabled = false;
  int settled_versions = 4;
  double tolerance_voxels = 0.5;
  double max_sigma_m = 0.2;
  double min_overlap = 0.6;

  void Visit(OptionsVisitor& v) {
    v("enabled", enabled,
      "submaps of one place that have settled become one in the map, so that it stays small");
    v("settled_versions", settled_versions, Between(1, 1000),
      "solutions of the pose graph over which two submaps must have kept their relative pose");
    v("tolerance_voxels", tolerance_voxels, Between(0, 10),
      "how far a submap's content may move and still count as kept; beyond, what was fused is "
      "taken apart");
    v("max_sigma_m", max_sigma_m, Between(0, 100),
      "of two submaps that are fused: sum of their horizontal standard deviations");
    v("min_overlap", min_overlap, Between(0.01, 1),
      "share of a submap's bricks of 8 x 8 x 8 voxels that the one it is fused into also has");
  }
};

/// All submaps of a mission at the newest poses, shown in a map: each for itself, or several fused
/// into one, see Fuse(). The number of submaps in the map, and with it the work of a query, is then
/// bounded by the space that was seen, not by the time that it took.
///
/// A submap joins the oldest one (the first of a group) that it
///  - overlaps: `min_overlap` of its bricks lie in those of the first,
///  - is settled with: over the last `settled_versions` calls of Move() no corner of the box around
///    its content moved by more than `tolerance_voxels` in the frame of the first,
///  - is surely placed to: their sigmas add up to at most `max_sigma_m`.
/// A group is shown under the number of its first, at its pose, with the largest sigma of its
/// members. A group whose first may itself join an older one is taken apart and joins it; so is one
/// where the poses of a member have since moved by more than `tolerance_voxels` from where it was
/// fused: its members are shown singly again, and may join anew once they have settled.
///
/// The same calls give the same map. Fused submaps but the first are kept in memory as compressed
/// octree files, to be taken out again: memory grows with them, by much less than with their grids.
class SubmapFuser {
 public:
  /// Submaps that one call of Move() fuses at most (some 10 ms each): it stays short after
  /// much was taken apart, too.
  static constexpr int kMaxJoins = 16;

  /// `map` must outlive this, and its closed submaps be changed by this alone.
  SubmapFuser(SubmapMap& map, const FuseOptions& options, const SensorModel& model);

  /// Adds `submap` at `X_WM`, or replaces it. @pre submap != nullptr.
  void Place(SubmapPtr submap, const Pose3& X_WM);

  /// Takes a new solution of the pose graph: poses, and standard deviations [m] as in
  /// SubmapMap::SetSigmas(). What is told of submaps before they are placed counts for
  /// them, too.
  void Move(const std::map<SubmapId, Pose3>& X_WM,
            const std::vector<std::pair<SubmapId, double>>& sigmas_m);

  /// Forgets all submaps and poses.
  void Clear();

  int size() const { return static_cast<int>(nodes_.size()); }
  std::vector<SubmapId> ids() const;
  bool Has(SubmapId id) const { return nodes_.count(id) > 0; }
  /// @throws std::out_of_range for a number that is not here.
  const Pose3& X_WM(SubmapId id) const { return nodes_.at(id).placed.X_WM; }
  /// The submap as it was placed, whether it is fused or not.
  SubmapPtr submap(SubmapId id) const;
  /// The same without its voxels where it is fused: they are costly to get.
  SubmapPtr outline(SubmapId id) const { return nodes_.at(id).placed.submap; }

  /// How many submaps the map does not show for themselves, since they were fused into another.
  int fused() const { return size() - map_.size(); }
  /// Bytes that fused submaps are kept in.
  std::size_t packed_bytes() const;

 private:
  struct Node {
    PlacedSubmap placed;      // The grid is empty while it is packed.
    std::string packed_grid;  // Of a submap that was fused into another: a compressed octree file
    std::size_t octree_bytes = 0;  // of this size.
    bool is_packed() const { return octree_bytes > 0; }
  };
  /// The members but the first, at the poses in its frame F at which they were fused.
  using Group = std::map<SubmapId, Pose3>;

  void Pack(Node& node) const;
  void Unpack(Node& node) const;
  static BrickGrid GridOf(const Node& packed);
  void SplitDisagreeing();
  bool Disagrees(const Node& first, const Group& group) const;
  void TakeApart(SubmapId first);
  void TakeApartGroupOf(SubmapId id);
  void JoinSettled();
  bool MayJoin(SubmapId id, SubmapId first) const;
  bool IsSettled(SubmapId id, SubmapId first) const;
  void Join(SubmapId first, const std::vector<SubmapId>& ids);
  void ShowPoses();
  void ShowSigmas();
  /// How far `X_FM` and `other_X_FM` place content of `placed` apart, at most [m].
  static double DistanceBetween(const PlacedSubmap& placed, const Pose3& X_FM,
                                const Pose3& other_X_FM);

  SubmapMap& map_;
  FuseOptions options_;
  SensorModel model_;
  double tolerance_m_;
  std::map<SubmapId, Node> nodes_;
  std::map<SubmapId, Group> groups_;               // By the number of the first.
  std::set<SubmapId> full_;                        // Firsts whose grid cannot take more.
  std::deque<std::map<SubmapId, Pose3>> history_;  // X_WM of the last versions, newest last.
};

}  // namespace vog
