#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "lib/base/random.h"
#include "lib/collision/collision_checker.h"
#include "lib/geometry/waypoint.h"
#include "lib/planner/planner_options.h"

namespace vog {

struct TreeNode {
  Waypoint at;
  int parent = -1;
  double edge_m = 0;       ///< Length of the edge from the parent.
  double from_root_m = 0;  ///< Of the path from the root.
  int visible = 0;         ///< Unknown voxels seen from here; below the threshold it counts as 0.
  double gain = 0;         ///< Of the branch up to here, eq. 7.
};

/// What a tree sees of the world while it grows.
struct TreeContext {
  const OccupancyMap& map;
  const CollisionChecker& checker;
  std::function<int(const Waypoint&)> visible;  ///< Visible(M, xi) of eq. 7.
};

/// The rapidly exploring random tree of section IV-B: views that the vehicle can fly to, each with
/// its gain
///
///   Gain(n) = Gain(parent) + Visible(M, n) * exp(-lambda * c)
class NbvTree {
 public:
  NbvTree(const PlannerOptions& options, const Eigen::AlignedBox3d& box_W, const Waypoint& root);

  /// Adds a chain of waypoints behind the root as far as its edges are free: the rest of the branch
  /// that the last tree found best.
  void AddBranch(const TreeContext& context, const std::vector<Waypoint>& waypoints);

  /// Grows to `nodes` nodes, or until `max_samples` samples have been tried in all.
  void GrowTo(const TreeContext& context, int nodes, Random& random);

  /// Grows to `nodes` nodes without looking at gains.
  void Spread(const TreeContext& context, int nodes, Random& random);

  /// Grows towards `target`, every other sample being the target itself, without looking at gains.
  /// Returns the node nearest to it.
  int GrowToward(const TreeContext& context, const Waypoint& target, int nodes, Random& random);

  /// Adds turns on the spot; they need no room beside the vehicle's own.
  void AddTurns(const TreeContext& context, int turns);

  const std::vector<TreeNode>& nodes() const { return nodes_; }
  /// The node with the highest gain; the root when none gains anything.
  int best() const { return best_; }
  /// Waypoints from the root, included, to node `index`.
  std::vector<Waypoint> BranchTo(int index) const;

 private:
  template <class MakeSample, class Add>
  void Grow(const TreeContext& context, int nodes, MakeSample make_sample, Add add);
  std::optional<Waypoint> Steer(const TreeContext& context, int parent, const Waypoint& at) const;
  Waypoint Sample(Random& random) const;
  int NearestTo(const Vec3& p_W) const;
  int AddNode(int parent, const Waypoint& at);
  void AddView(const TreeContext& context, int parent, const Waypoint& at);

  const PlannerOptions& options_;
  Eigen::AlignedBox3d box_W_;
  std::vector<TreeNode> nodes_;
  int best_ = 0;
  int samples_ = 0;
};

}  // namespace vog
