#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/collision/collision_checker.h"
#include "lib/geometry/pose.h"

namespace vog {

/// A box in W that the vehicle must not enter: a table [[keep_out]] for each.
struct KeepOutOptions {
  Vec3 min_m = Vec3::Zero();
  Vec3 max_m = Vec3::Zero();

  void Visit(OptionsVisitor& v) {
    v("min_m", min_m, Between(-1e4, 1e4), "lower corner of a box in W that no part may enter");
    v("max_m", max_m, Between(-1e4, 1e4), "upper corner; the default is no box");
  }
};

/// Where the vehicle goes when the mission is over.
enum class HomePlace { kStart, kPlace };

/// The box that is to be explored: the vehicle's centre stays inside, and only unknown voxels
/// inside count as gain. Default: the propeller's, 12 x 7 x 3.5 m.
struct ExplorationOptions {
  Vec3 min_m = {-6, -3.5, -1.75};
  Vec3 max_m = {6, 3.5, 1.75};
  double max_depth_m = 1e4;
  HomePlace home = HomePlace::kStart;
  Vec3 home_m = {0, 0, 0};
  std::vector<KeepOutOptions> keep_out;  ///< From the tables [[keep_out]].

  void Visit(OptionsVisitor& v) {
    v("min_m", min_m, Between(-1e4, 1e4), "lower corner of the exploration box in W");
    v("max_m", max_m, Between(-1e4, 1e4), "upper corner");
    v("max_depth_m", max_depth_m, Between(-1e4, 1e4),
      "the vehicle's centre goes no deeper below z = 0 of W, whatever the box says");
    v("home", home, Names<HomePlace>{{HomePlace::kStart, "start"}, {HomePlace::kPlace, "place"}},
      "where the mission ends: where it started, or at home_m");
    v("home_m", home_m, Between(-1e4, 1e4), "the place in W, with home = \"place\"");
  }

  /// Reads both tables, over what `options` has.
  /// @throws UsageError like Config::Read(), and if a box is empty.
  static ExplorationOptions From(const Config& config, ExplorationOptions options) {
    options = config.Read<ExplorationOptions>("exploration", options);
    const int boxes = config.CountOf("keep_out");
    if (boxes > 0) options.keep_out.clear();
    for (int i = 0; i < boxes; ++i) {
      const std::string name = "keep_out[" + std::to_string(i) + "]";
      const auto box = config.Read<KeepOutOptions>(name);
      if (box.min_m == box.max_m) continue;
      options.keep_out.push_back(box);
      if (!(box.max_m.array() > box.min_m.array()).all())
        throw UsageError(config.WhereIs(name) +
                         "keep_out.max_m must be larger than keep_out.min_m on every axis");
    }
    if (!(options.box_W().max().array() > options.box_W().min().array()).all())
      throw UsageError(
          "exploration.max_m must be larger than exploration.min_m on every axis, and above "
          "exploration.max_depth_m");
    return options;
  }

  static ExplorationOptions From(const Config& config) {
    return From(config, ExplorationOptions());
  }

  Eigen::AlignedBox3d box_W() const {
    return {Vec3(min_m.x(), min_m.y(), std::max(min_m.z(), -max_depth_m)), max_m};
  }
  std::vector<Eigen::AlignedBox3d> keep_out_W() const {
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const KeepOutOptions& box : keep_out) boxes.emplace_back(box.min_m, box.max_m);
    return boxes;
  }
};

enum class PlannerKind {
  kCoverage,      ///< The best view of all that can be reached.
  kNextBestView,  ///< The paper's tree.
};
/// The planners' names in configuration files and metrics.
inline const Names<PlannerKind>& PlannerKindNames() {
  static const Names<PlannerKind> names = {{PlannerKind::kCoverage, "coverage"},
                                           {PlannerKind::kNextBestView, "nbvp"}};
  return names;
}

/// How fast plans are flown.
struct MotionLimits {
  double max_speed_m_s = 0.25;
  double max_yaw_rate_rad_s = 0.15;
};

enum class UnknownSpace { kBlocks, kPassable };
/// c of eq. 7: the length of the edge, as it prints, or of the path from the root.
enum class Discount { kEdge, kRoot };

struct PlannerOptions {
  PlannerKind kind = PlannerKind::kCoverage;
  UnknownSpace unknown = UnknownSpace::kBlocks;
  Discount discount = Discount::kEdge;
  double lambda_1_m = 0.5;
  double max_edge_m = 2;
  int tree_nodes = 15;
  int max_tree_nodes = 200;
  int max_samples = 2000;
  double range_m = 5;
  double ray_step_deg = 1.5;
  int zero_gain_voxels = 50;
  double view_time_s = 4;
  double surface_weight = 5;
  Vec3 hull_size_m = {1.0, 1.0, 0.5};
  double clearance_m = 0.15;
  double unknown_clearance_m = 0.05;
  double uncertainty_sigmas = 2;
  double max_uncertainty_m = 0.5;
  double bubble_radius_m = 1.2;
  double revisit_share = 0;
  double goal_tolerance_m = 0.15;
  double goal_tolerance_rad = 0.1;

  void Visit(OptionsVisitor& v) {
    v("kind", kind, PlannerKindNames(),
      "coverage: the best view of all that can be reached; nbvp: the paper's tree of random views");
    v("unknown", unknown,
      Names<UnknownSpace>{{UnknownSpace::kBlocks, "blocks"}, {UnknownSpace::kPassable, "passable"}},
      "whether the vehicle may move through space that nobody has seen");
    v("discount", discount, Names<Discount>{{Discount::kEdge, "edge"}, {Discount::kRoot, "root"}},
      "the cost in eq. 7: length of the edge, or of the path from the root");
    v("lambda_1_m", lambda_1_m, Between(0, 100), "lambda of eq. 7");
    v("max_edge_m", max_edge_m, Between(0.1, 100), "longest edge of the tree");
    v("tree_nodes", tree_nodes, Between(1, 100000), "N_max");
    v("max_tree_nodes", max_tree_nodes, Between(1, 100000), "N_tol, used while no view gains");
    v("max_samples", max_samples, Between(1, 1e7), "samples tried for one tree at most");
    v("range_m", range_m, Between(0.1, 500), "d_planner_max: how far a view is counted");
    v("ray_step_deg", ray_step_deg, Between(0.05, 30), "angle between the rays of a view");
    v("zero_gain_voxels", zero_gain_voxels, Between(0, 1e9), "a smaller view counts as nothing");
    v("view_time_s", view_time_s, Between(0.1, 1000),
      "coverage: what a view costs beside the way to it; much makes the vehicle go far for much to "
      "see, little takes what is near");
    v("surface_weight", surface_weight, Between(0, 1000),
      "coverage: an unknown voxel beside an occupied one counts like this many others");
    v("hull_size_m", hull_size_m, Between(0.01, 100), "the vehicle's box");
    v("clearance_m", clearance_m, Between(0, 10), "kept between the box and occupied voxels");
    v("unknown_clearance_m", unknown_clearance_m, Between(0, 10), "and unknown ones");
    v("uncertainty_sigmas", uncertainty_sigmas, Between(0, 10),
      "the first clearance grows by this many standard deviations of the vehicle's place relative "
      "to the submaps that saw the voxel");
    v("max_uncertainty_m", max_uncertainty_m, Between(0, 10), "but not by more than this");
    v("bubble_radius_m", bubble_radius_m, Between(0, 100),
      "unknown space taken for free at the start: what a turn on the spot needs, and the rest "
      "where the sonar has looked");
    v("revisit_share", revisit_share, Between(0, 1),
      "most of the mission's time that may go into seeing earlier submaps again, where a loop "
      "closure would make the map more certain, 0.15 for example; 0: none");
    v("goal_tolerance_m", goal_tolerance_m, Between(0.01, 5), "an edge is done this near its end");
    v("goal_tolerance_rad", goal_tolerance_rad, Between(0.01, 3), "and turned this near to it");
  }

  /// What is placed less certainly than this may be farther from where the map shows it than
  /// clearances grow: there it is not they that protect the vehicle, but that it sees where it
  /// goes.
  double sure_sigma_m() const { return max_uncertainty_m / std::max(1e-9, uncertainty_sigmas); }

  CollisionRules collision_rules() const {
    return {hull_size_m,         clearance_m,
            unknown_clearance_m, unknown == UnknownSpace::kBlocks,
            uncertainty_sigmas,  max_uncertainty_m};
  }
};

}  // namespace vog
