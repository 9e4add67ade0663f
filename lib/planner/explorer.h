#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/time.h"
#include "lib/planner/mission_options.h"
#include "lib/planner/nbv_tree.h"

namespace vog {

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
/// moved backs out along the way it came, or else leaves with the bare hull.
class Explorer {
 public:
  Explorer(const PlannerOptions& options, const ExplorationOptions& exploration,
           const SonarOptions& sonar, const MissionOptions& mission);

  /// The place around which unknown space is taken for free: where the vehicle started.
  void SetStart(const Vec3& p_W);

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
  enum class PlanKind {
    kPath,     ///< Tested while it is flown.
    kWayBack,  ///< Out of a place that the map has closed; not tested.
    kHold,     ///< Stay for a while.
  };

  bool NeedsPlan(const OccupancyMap& map, const Waypoint& at, Time now);
  bool HasReached(const Waypoint& at) const;
  bool IsBlocked(const OccupancyMap& map, const Waypoint& at) const;
  void MakePlan(const OccupancyMap& map, const Waypoint& at);
  bool Explore(const OccupancyMap& map, const Waypoint& at);
  bool Revisit(const OccupancyMap& map, const Waypoint& at);
  /// Back along the way the vehicle came, to where there is room.
  bool BackOut(const OccupancyMap& map, const Waypoint& at);
  /// With the bare hull to any place with more room than here.
  bool Escape(const OccupancyMap& map, const Waypoint& at);

  /// The rules with a share of the clearances, for a vehicle at `at`.
  CollisionChecker CheckerAt(const OccupancyMap& map, const Waypoint& at, double share) const;
  /// The largest share of the clearances that a place offers.
  double FreeShareAt(const OccupancyMap& map, const Waypoint& at) const;
  /// The rules to plan with from `at`; nothing where it offers too little.
  std::optional<CollisionChecker> CheckerFor(const OccupancyMap& map, const Waypoint& at);

  void UseFirstEdge(const NbvTree& tree);
  void SetPlan(std::vector<Waypoint> path, PlanKind kind, const NbvTree* tree = nullptr,
               int best = -1);
  void Finish(const char* reason, const Waypoint& at);
  void Remember(const Waypoint& at);
  Random NextRandom();

  PlannerOptions options_;
  Eigen::AlignedBox3d box_W_;
  MissionOptions mission_;
  CollisionChecker checker_;
  ViewGain view_;

  ExplorerState state_ = ExplorerState::kExploring;
  std::string end_reason_;
  std::optional<Plan> plan_;
  PlanKind kind_ = PlanKind::kHold;
  std::vector<Waypoint> remainder_;  // Of the last best branch, behind its first edge.
  Time planned_at_, checked_at_;
  double flight_share_ = 0;  // Of the clearances, that the plan in flight must keep.
  std::int64_t plans_ = 0, trees_ = 0;
  std::vector<Waypoint> history_;
  std::size_t next_revisit_ = 0;
  int failures_ = 0;  // Plans in a row that led nowhere.
};

}  // namespace vog
