#include "lib/planner/coverage_planner.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "lib/planner/flown_step.h"

namespace vog {
namespace {

/// Places looked at in one plan: in all, of them new ones, and how many are kept for the search
/// that ends the exploration.
constexpr int kPlaces = 50, kNewPlaces = 22, kLastPlaces = 15;
/// Views of the tree looked at in one plan.
constexpr int kTreeViews = 10;
/// Views whose ways are tested in one plan.
constexpr int kWays = 12;
/// A view is done with when less than this share of it is left.
constexpr double kShareLeft = 0.2;
/// Full cycles of the sweep after which what stays unknown will not be seen.
constexpr double kCycles = 2;

int LooksInVain(const SonarOptions& sonar) {
  return std::clamp(static_cast<int>(std::ceil(kCycles * SweepPeriod_s(sonar))), 2, 255);
}

}  // namespace

CoveragePlanner::CoveragePlanner(const PlannerOptions& options, const MotionLimits& limits,
                                 const SonarOptions& sonar, const Eigen::AlignedBox3d& box_W,
                                 std::int64_t seed)
    : options_(options),
      limits_(limits),
      box_W_(box_W),
      seed_(seed),
      view_(sonar, options.range_m, options.ray_step_deg, box_W),
      panorama_(sonar, options.range_m, box_W),
      looked_at_(box_W, LooksInVain(sonar)),
      routes_(options, limits, box_W) {}

void CoveragePlanner::Look(const OccupancyMap& map, const Waypoint& at) {
  looked_at_.Note(map.grid(), view_.See(map, at));
}

double CoveragePlanner::WeightOf(const VoxelKey& key) const {
  if (looked_at_.IsInVain(key)) return 0;
  return routes_.free_places().IsNextToOccupied(key) ? options_.surface_weight : 1;
}

double CoveragePlanner::GainAt(const OccupancyMap& map, const Waypoint& at) const {
  double gain = 0;
  int voxels = 0;
  for (const VoxelKey& key : view_.See(map, at)) {
    const double weight = WeightOf(key);
    gain += weight;
    voxels += weight > 0;
  }
  return voxels < options_.zero_gain_voxels ? 0 : gain;
}

bool CoveragePlanner::IsObsolete(const OccupancyMap& map, const std::vector<Waypoint>& path) const {
  return GainAt(map, path.back()) < kShareLeft * gain_of_plan_;
}

CoveragePlanner::Known& CoveragePlanner::KnownOf(const Reached& reached) {
  return reached.place < 0 ? known_.back() : known_[static_cast<std::size_t>(reached.place)];
}

void CoveragePlanner::LookFrom(const OccupancyMap& map, const Reached& reached) {
  --looks_left_;
  Known& known = KnownOf(reached);
  known.gain = panorama_.Look(map, routes_.PositionOf(reached),
                              [this](const VoxelKey& key) { return WeightOf(key); });
  known.in_plan = plans_;
}

double CoveragePlanner::ViewsASecond(const Reached& reached, int heading, const Waypoint& at) {
  const auto turn_s = [&](double from_rad, double to_rad) {
    return std::abs(WrapAngle(to_rad - from_rad)) / limits_.max_yaw_rate_rad_s;
  };
  const double yaw_rad = YawOfHeading(heading);
  const Known& known = KnownOf(reached);
  double flight_s = std::max(reached.time_s, turn_s(at.yaw_rad, yaw_rad));
  if (known.ahead_in_plan == plans_ && known.goes_ahead) {
    const double ahead_rad = YawAlong(routes_.PositionOf(reached) - at.position_W_m);
    flight_s = turn_s(at.yaw_rad, ahead_rad) + reached.time_s + turn_s(ahead_rad, yaw_rad);
  }
  return 1 / (options_.view_time_s + flight_s);
}

bool CoveragePlanner::MustGoAhead(const OccupancyMap& map, const CollisionChecker& checker,
                                  const Waypoint& at, const Reached& reached) {
  const Waypoint to{routes_.PositionOf(reached), at.yaw_rad};
  Known& known = KnownOf(reached);
  known.ahead_in_plan = plans_;
  known.goes_ahead =
      GoesSideways(to.position_W_m - at.position_W_m) && !checker.IsSurelyKnown(map, at, to);
  return known.goes_ahead;
}

CoveragePlanner::View CoveragePlanner::BestViewAt(int index, const Waypoint& at) {
  const Reached& reached = routes_.reached()[static_cast<std::size_t>(index)];
  const GainByHeading& gain = KnownOf(reached).gain;
  View best{index, 0, 0};
  for (int heading = 0; heading < kHeadings; ++heading) {
    const double voxels = gain[static_cast<std::size_t>(heading)];
    if ((reached.arc >> heading & 1) == 0 || voxels < options_.zero_gain_voxels) continue;
    const double utility = voxels * ViewsASecond(reached, heading, at);
    if (utility > best.utility) best = {index, heading, utility};
  }
  return best;
}

void CoveragePlanner::LookAtNewPlaces(const OccupancyMap& map) {
  known_.resize(static_cast<std::size_t>(routes_.free_places().places()) + 1);
  LookFrom(map, routes_.reached().front());
  for (const Reached& reached : routes_.reached()) {
    if (KnownOf(reached).in_plan >= 0) continue;
    if (looks_left_ <= kPlaces - kNewPlaces) return;
    LookFrom(map, reached);
  }
}

CoveragePlanner::View CoveragePlanner::FindBest(const OccupancyMap& map,
                                                const CollisionChecker& checker,
                                                const Waypoint& at) {
  const auto worse = [](const View& a, const View& b) {
    return std::tie(a.utility, b.reached) < std::tie(b.utility, a.reached);
  };
  std::priority_queue<View, std::vector<View>, decltype(worse)> queue(worse);
  for (std::size_t i = 0; i < routes_.reached().size(); ++i) {
    const View view = BestViewAt(static_cast<int>(i), at);
    if (view.utility > 0) queue.push(view);
  }
  while (!queue.empty()) {
    const View view = queue.top();
    queue.pop();
    const Reached& reached = routes_.reached()[static_cast<std::size_t>(view.reached)];
    if (KnownOf(reached).in_plan != plans_) {
      if (looks_left_ <= kLastPlaces) break;
      LookFrom(map, reached);
    } else if (KnownOf(reached).ahead_in_plan == plans_ ||
               !MustGoAhead(map, checker, at, reached)) {
      // Where the panorama promises something, look with all rays.
      const Waypoint to{routes_.PositionOf(reached), YawOfHeading(view.heading)};
      const double gain = GainAt(map, to);
      float& promised = KnownOf(reached).gain[static_cast<std::size_t>(view.heading)];
      if (gain > 0 && gain >= promised / 2) {
        gain_of_plan_ = gain;
        return view;
      }
      promised = static_cast<float>(gain);
    }
    const View again = BestViewAt(view.reached, at);
    if (again.utility > 0) queue.push(again);
  }
  return {};
}

ViewPlan CoveragePlanner::GoTo(const View& view, const std::vector<Waypoint>& way) {
  ViewPlan plan;
  plan.outcome = ViewPlan::Outcome::kGo;
  for (const Waypoint& waypoint : way) {
    TreeNode node{.at = waypoint, .parent = static_cast<int>(plan.tree.size()) - 1};
    if (node.parent >= 0) {
      const TreeNode& before = plan.tree.back();
      node.edge_m = LengthOf(before.at, waypoint);
      node.from_root_m = before.from_root_m + node.edge_m;
    }
    plan.tree.push_back(node);
  }
  plan.tree.back().visible = static_cast<int>(gain_of_plan_);
  plan.tree.back().gain = view.utility;
  plan.best = static_cast<int>(plan.tree.size()) - 1;
  plan.path = FirstPartOf(way, options_.max_edge_m);
  return plan;
}

ViewPlan CoveragePlanner::LookForMore(const OccupancyMap& map) {
  ViewPlan plan;
  plan.outcome = ViewPlan::Outcome::kNothing;
  if (nothing_since_ < 0) nothing_since_ = plans_;
  for (const Reached& reached : routes_.reached()) {
    if (KnownOf(reached).in_plan >= nothing_since_) continue;
    plan.outcome = ViewPlan::Outcome::kLookOn;
    if (looks_left_ <= 0) break;
    LookFrom(map, reached);
  }
  return plan;
}

ViewPlan CoveragePlanner::GrowTree(const OccupancyMap& map, const CollisionChecker& checker,
                                   const Waypoint& at) {
  // The same tree in each plan, as far as the map is the same; in each some of its views are
  // looked at.
  const int first = tree_views_;
  tree_views_ += kTreeViews;
  if (first == 0) tree_of_plan_ = plans_;
  int view = 0;
  const TreeContext context{map, checker, [&](const Waypoint& to) {
                              const bool is_due = view >= first && view < tree_views_;
                              ++view;
                              return is_due ? static_cast<int>(GainAt(map, to)) : 0;
                            }};
  Random random(static_cast<std::uint64_t>(seed_), "coverage",
                static_cast<std::uint64_t>(tree_of_plan_));
  NbvTree tree(options_, box_W_, at);
  tree.GrowTo(context, options_.max_tree_nodes, random);
  ViewPlan plan = PlanOf(tree);
  if (plan.outcome != ViewPlan::Outcome::kGo) {
    if (tree_views_ < view) {
      plan.outcome = ViewPlan::Outcome::kLookOn;
    } else {
      tree_views_ = 0;
    }
    return plan;
  }
  NoteGain();
  gain_of_plan_ = tree.nodes()[static_cast<std::size_t>(plan.best)].visible;
  plan.path = FirstPartOf(plan.path, options_.max_edge_m);
  return plan;
}

void CoveragePlanner::NoteGain() {
  nothing_since_ = -1;
  tree_views_ = 0;
}

ViewPlan CoveragePlanner::Plan(const OccupancyMap& map, const CollisionChecker& checker,
                               const Waypoint& at) {
  ++plans_;
  looks_left_ = kPlaces;
  routes_.Search(map, checker, at);
  LookAtNewPlaces(map);
  bool was_refused = false;
  for (int tries = 0; tries < kWays; ++tries) {
    const View view = FindBest(map, checker, at);
    if (view.reached < 0) break;
    auto way = routes_.RouteTo(map, checker, view.reached, YawOfHeading(view.heading));
    if (way) {
      NoteGain();
      return GoTo(view, *way);
    }
    was_refused = true;
  }
  ViewPlan plan = LookForMore(map);
  if (plan.outcome == ViewPlan::Outcome::kNothing) plan = GrowTree(map, checker, at);
  if (plan.outcome == ViewPlan::Outcome::kNothing && was_refused)
    plan.outcome = ViewPlan::Outcome::kLookOn;
  return plan;
}

}  // namespace vog
