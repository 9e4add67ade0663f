#include "lib/planner/explorer.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr Duration kCheckPeriod = std::chrono::seconds(1);
constexpr Duration kPlanTimeout = std::chrono::seconds(60);
constexpr int kTurns = 8;
// Distance within which a submap's base is near.
constexpr double kNearby_m = 3;
constexpr double kHistoryStep_m = 0.5;
constexpr double kHistoryStep_rad = 0.5;
constexpr double kRevisitProgress_m = 0.3;
constexpr int kMaxFailures = 20;
// A clearance larger than this leaves no way anywhere.
constexpr double kMaxUncertainty_m = 1;

}  // namespace

Explorer::Explorer(const PlannerOptions& options, const ExplorationOptions& exploration,
                   const SonarOptions& sonar, const MissionOptions& mission)
    : options_(options),
      box_W_(exploration.box_W()),
      mission_(mission),
      checker_(options.collision_rules()),
      view_(sonar, options.range_m, options.ray_step_deg, box_W_) {}

void Explorer::SetStart(const Vec3& p_W) { checker_.SetBubble({p_W, options_.bubble_radius_m}); }

Random Explorer::NextRandom() {
  return Random(static_cast<std::uint64_t>(mission_.seed), "planner",
                static_cast<std::uint64_t>(trees_++));
}

double Explorer::ExploredVolume(const OccupancyMap& map) const {
  constexpr int kStride = 3;
  const VoxelBox box = VoxelsOf(map.grid(), box_W_);
  std::vector<VoxelKey> voxels;
  for (std::int32_t z = box.min.z; z <= box.max.z; z += kStride)
    for (std::int32_t y = box.min.y; y <= box.max.y; y += kStride)
      for (std::int32_t x = box.min.x; x <= box.max.x; x += kStride) voxels.push_back({x, y, z});
  std::vector<float> log_odds(voxels.size());
  map.LogOddsOf(voxels, log_odds);
  const auto known = std::count_if(log_odds.begin(), log_odds.end(), IsKnown);
  return static_cast<double>(known) / static_cast<double>(voxels.size()) * box_W_.volume();
}

const Plan* Explorer::Update(const OccupancyMap& map, const Pose3& X_WB, Time now, int submaps) {
  if (state_ == ExplorerState::kFinished) return nullptr;
  const Waypoint at = WaypointOf(X_WB);
  Remember(at);
  if (submaps >= mission_.max_submaps) {
    Finish("max_submaps", at);
    return plan();
  }
  if (!NeedsPlan(map, at, now)) return nullptr;
  MakePlan(map, at);
  planned_at_ = checked_at_ = now;
  return plan();
}

bool Explorer::NeedsPlan(const OccupancyMap& map, const Waypoint& at, Time now) {
  if (!plan_ || HasReached(at) || now - planned_at_ > kPlanTimeout) return true;
  if (now - checked_at_ < kCheckPeriod) return false;
  checked_at_ = now;
  return IsBlocked(map, at);
}

bool Explorer::HasReached(const Waypoint& at) const {
  const Waypoint& goal = plan_->path.back();
  return LengthOf(at, goal) < options_.goal_tolerance_m &&
         std::abs(WrapAngle(goal.yaw_rad - at.yaw_rad)) < options_.goal_tolerance_rad;
}

bool Explorer::IsBlocked(const OccupancyMap& map, const Waypoint& at) const {
  // The rest of the path begins behind the waypoint that the vehicle is nearest to leaving.
  const std::vector<Waypoint>& path = plan_->path;
  std::size_t next = path.size() - 1;
  double least_m = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double detour_m =
        LengthOf(path[i], at) + LengthOf(at, path[i + 1]) - LengthOf(path[i], path[i + 1]);
    if (detour_m < least_m - 1e-6) {
      least_m = detour_m;
      next = i + 1;
    }
  }
  // Half the clearance is the controller's to use up.
  const double extra_m = -0.5 * options_.clearance_m;
  Waypoint from = at;
  for (std::size_t i = next; i < path.size(); ++i) {
    if (!checker_.IsEdgeFree(map, from, path[i], extra_m)) return true;
    from = path[i];
  }
  return false;
}

double Explorer::UncertaintyNear(const Vec3& p_W) const {
  double nearby = std::numeric_limits<double>::infinity();
  double nearest = 0, nearest_m = std::numeric_limits<double>::max();
  for (const PlaceUncertainty& place : places_) {
    const double distance_m = (place.position_W_m - p_W).norm();
    if (distance_m < kNearby_m) nearby = std::min(nearby, place.sigma_m);
    if (distance_m < nearest_m) {
      nearest_m = distance_m;
      nearest = place.sigma_m;
    }
  }
  return std::isfinite(nearby) ? nearby : nearest;
}

void Explorer::MakePlan(const OccupancyMap& map, const Waypoint& at) {
  const bool found = state_ == ExplorerState::kRevisiting ? Revisit(map, at) : Explore(map, at);
  if (found) {
    failures_ = 0;
    return;
  }
  if (state_ == ExplorerState::kFinished) return;
  if (++failures_ > kMaxFailures || !BackOut(map, at)) Finish("stuck", at);
}

bool Explorer::Explore(const OccupancyMap& map, const Waypoint& at) {
  const ExtraClearance by_uncertainty = [this](const Vec3& p_W) {
    return std::min(kMaxUncertainty_m, options_.uncertainty_sigmas * UncertaintyNear(p_W));
  };
  const ExtraClearance none = [](const Vec3&) { return 0.0; };
  const ExtraClearance bare_hull = [this](const Vec3&) { return -options_.clearance_m; };
  bool could_move = false;
  for (const ExtraClearance* extra_m : {&by_uncertainty, &none, &bare_hull}) {
    // The bare hull is for getting out, not for going on.
    if (extra_m == &bare_hull && could_move) break;
    if (!checker_.IsFree(map, at, (*extra_m)(at.position_W_m))) continue;
    const TreeContext context{map, checker_, view_, *extra_m};
    Random random = NextRandom();
    NbvTree tree(options_, box_W_, at);
    tree.AddBranch(context, remainder_);
    tree.GrowTo(context, options_.tree_nodes, random);
    if (tree.best() == 0) tree.AddTurns(context, kTurns);
    if (tree.best() == 0) tree.GrowTo(context, options_.max_tree_nodes, random);
    could_move |= tree.nodes().size() > 1;
    if (tree.best() == 0) continue;
    Use(tree, tree.best(), /*first_edge_only=*/true);
    return true;
  }
  if (!could_move) return false;
  if (mission_.when_done == WhenDone::kEnd) {
    Finish("nothing_to_gain", at);
    return false;
  }
  state_ = ExplorerState::kRevisiting;
  return Revisit(map, at);
}

bool Explorer::Revisit(const OccupancyMap& map, const Waypoint& at) {
  const ExtraClearance none = [](const Vec3&) { return 0.0; };
  const TreeContext context{map, checker_, view_, none};
  for (std::size_t tries = 0; tries < history_.size(); ++tries) {
    const Waypoint target = history_[next_revisit_ % history_.size()];
    Random random = NextRandom();
    NbvTree tree(options_, box_W_, at);
    const int node = tree.GrowToward(context, target, options_.tree_nodes, random);
    const double left_m = LengthOf(tree.nodes()[node].at, target);
    if (node != 0 && left_m < LengthOf(at, target) - kRevisitProgress_m) {
      Use(tree, node, /*first_edge_only=*/false);
      return true;
    }
    ++next_revisit_;
    if (node != 0 && left_m < kRevisitProgress_m) {
      Use(tree, node, /*first_edge_only=*/false);
      return true;
    }
  }
  return false;
}

bool Explorer::BackOut(const OccupancyMap& map, const Waypoint& at) {
  Plan plan{++plans_, {at}, {}, -1};
  for (auto back = history_.rbegin(); back != history_.rend(); ++back) {
    plan.path.push_back(*back);
    if (LengthOf(at, *back) > kHistoryStep_m && checker_.IsFree(map, *back)) break;
  }
  if (plan.path.size() < 2) return false;
  remainder_.clear();
  plan_ = std::move(plan);
  return true;
}

void Explorer::Use(const NbvTree& tree, int node, bool first_edge_only) {
  std::vector<Waypoint> branch = tree.BranchTo(node);
  remainder_.clear();
  if (first_edge_only) {
    remainder_.assign(branch.begin() + 2, branch.end());
    branch.resize(2);
  }
  plan_ = Plan{++plans_, std::move(branch), tree.nodes(), node};
}

void Explorer::Finish(const char* reason, const Waypoint& at) {
  state_ = ExplorerState::kFinished;
  end_reason_ = reason;
  plan_ = Plan{++plans_, {at}, {}, -1};
}

void Explorer::Remember(const Waypoint& at) {
  if (!history_.empty() && LengthOf(history_.back(), at) < kHistoryStep_m &&
      std::abs(WrapAngle(history_.back().yaw_rad - at.yaw_rad)) < kHistoryStep_rad)
    return;
  history_.push_back(at);
}

}  // namespace vog
