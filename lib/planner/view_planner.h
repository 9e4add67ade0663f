#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lib/collision/collision_checker.h"
#include "lib/planner/nbv_tree.h"
#include "lib/scan/sonar.h"

namespace vog {

/// What a planner of views answers.
struct ViewPlan {
  enum class Outcome {
    kGo,       ///< Fly the path.
    kLookOn,   ///< Nothing found yet, not all has been looked at: ask again.
    kNothing,  ///< No view that can be reached gains anything.
    kNoWay,    ///< The vehicle cannot move from where it is.
  };
  Outcome outcome = Outcome::kNoWay;
  bool is_confined = false;    ///< With these clearances it can neither turn around nor go far.
  std::vector<Waypoint> path;  ///< From the vehicle on; a single one: look on from here.
  std::vector<TreeNode> tree;  ///< What was considered; the vehicle is its root.
  int best = -1;               ///< Node that the best branch ends in.
};

/// Decides where to look next.
class ViewPlanner {
 public:
  virtual ~ViewPlanner() = default;

  /// The next path, for a vehicle at `at` that is free by the checker's rules.
  virtual ViewPlan Plan(const OccupancyMap& map, const CollisionChecker& checker,
                        const Waypoint& at) = 0;
  /// To be called once a second with where the vehicle is: what its sonar may see from there.
  virtual void Look(const OccupancyMap&, const Waypoint&) {}
  /// Whether flying on along `path` has become pointless. When it was planned, `visible` voxels
  /// were to be seen at its end.
  virtual bool IsObsolete(const OccupancyMap&, const std::vector<Waypoint>& /*path*/,
                          int /*visible*/) const {
    return false;
  }
  /// Whether the voxel was looked at for so long that it will stay unknown.
  virtual bool IsInVain(const VoxelKey&) const { return false; }
  /// The vehicle has gone another way than planned.
  virtual void Forget() {}
};

/// The best branch of a tree, if any of it gains.
ViewPlan PlanOf(const NbvTree& tree);

/// The planner that options.kind names. `seed` is the mission's.
std::unique_ptr<ViewPlanner> MakeViewPlanner(const PlannerOptions& options,
                                             const MotionLimits& limits, const SonarOptions& sonar,
                                             const Eigen::AlignedBox3d& box_W, std::int64_t seed);

}  // namespace vog
