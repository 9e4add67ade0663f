#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/time.h"
#include "lib/planner/mission_options.h"
#include "lib/planner/nbv_tree.h"

namespace vog {

/// A place whose surroundings some submap has seen, and how well the vehicle now knows where it is
/// relative to that submap.
struct PlaceUncertainty {
  Vec3 position_W_m = Vec3::Zero();
  double sigma_m = 0;
};

/// A path to fly, and the tree that it comes from.
struct Plan {
  std::int64_t id = 0;
  std::vector<Waypoint> path;  ///< From the vehicle's place on; a single waypoint: stay there.
  std::vector<TreeNode> tree;
  int best = -1;  ///< Node that the best branch ends in.
};

enum class ExplorerState { kExploring, kRevisiting, kFinished };

/// The receding-horizon next-best-view exploration of section IV-B as a machine that is told poses
/// and says where to go: it grows a tree, sends the first edge of the best branch, keeps the rest
/// to start the next tree with, and ends when no view gains anything or the budget is used.
///
/// Beyond the paper: a tree that cannot reach N_max nodes is used as it is; the path is tested
/// again while it is flown; a hull that finds itself inside its own clearance after the map has
/// moved first tries to leave with the bare hull, then backs out along the way it came.
class Explorer {
 public:
  Explorer(const PlannerOptions& options, const ExplorationOptions& exploration,
           const SonarOptions& sonar, const MissionOptions& mission);

  /// The place around which unknown space is taken for free: where the vehicle started.
  void SetStart(const Vec3& p_W);

  void SetUncertainty(std::vector<PlaceUncertainty> places) { places_ = std::move(places); }

  /// To be called with every pose. Returns the new plan when there is one.
  const Plan* Update(const OccupancyMap& map, const Pose3& X_WB, Time now, int submaps);

  /// Known volume inside the exploration box, by every third voxel on each axis [m^3].
  double ExploredVolume(const OccupancyMap& map) const;

  /// The plan in force; nullptr before the first.
  const Plan* plan() const { return plan_ ? &*plan_ : nullptr; }
  ExplorerState state() const { return state_; }
  /// nothing_to_gain, max_submaps or stuck; empty until finished.
  const std::string& end_reason() const { return end_reason_; }

 private:
  bool NeedsPlan(const OccupancyMap& map, const Waypoint& at, Time now);
  bool HasReached(const Waypoint& at) const;
  bool IsBlocked(const OccupancyMap& map, const Waypoint& at) const;
  void MakePlan(const OccupancyMap& map, const Waypoint& at);
  bool Explore(const OccupancyMap& map, const Waypoint& at);
  bool Revisit(const OccupancyMap& map, const Waypoint& at);
  bool BackOut(const OccupancyMap& map, const Waypoint& at);
  void Use(const NbvTree& tree, int node, bool first_edge_only);
  void Finish(const char* reason, const Waypoint& at);
  void Remember(const Waypoint& at);
  double UncertaintyNear(const Vec3& p_W) const;
  Random NextRandom();

  PlannerOptions options_;
  Eigen::AlignedBox3d box_W_;
  MissionOptions mission_;
  CollisionChecker checker_;
  ViewGain view_;

  ExplorerState state_ = ExplorerState::kExploring;
  std::string end_reason_;
  std::vector<PlaceUncertainty> places_;
  std::optional<Plan> plan_;
  std::vector<Waypoint> remainder_;  // Of the last best branch, behind its first edge.
  Time planned_at_, checked_at_;
  std::int64_t plans_ = 0, trees_ = 0;
  std::vector<Waypoint> history_;
  std::size_t next_revisit_ = 0;
  int failures_ = 0;  // Plans in a row that led nowhere.
};

}  // namespace vog
