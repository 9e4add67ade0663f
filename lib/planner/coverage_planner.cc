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
/// Ways to a place that are refused until it is left out, until the next plan that goes anywhere.
constexpr int kMostRefusals = 12;
/// Headings that a view turns on by, at most: less than a whole turn.
constexpr int kMostTurnsOn = kHeadings - 1;
/// A vehicle that reaches fewer places and cannot turn on its own is confined.
constexpr std::size_t kFewPlaces = 10;
/// A view is done with when less than this share of it is left.
constexpr double kShareLeft = 0.2;
/// Full cycles of the sweep after which what stays unknown will not be seen.
constexpr double kCycles = 2;

int LooksInVain(const SonarOptions& sonar) {
  return std::clamp(static_cast<int>(std::ceil(kCycles * SweepPeriod_s(sonar))), 2, 255);
}

/// Of what a fan that stands still and sweeps sees of the next heading, what it sees while it turns
/// over it: the part that is not in the fan yet, but for the gaps that the sweep leaves. It is a
/// triangle wave: at a share u of its rise looks are u and 1 - u of a period apart. Each sees the
/// fan's width of what is turned by in a period, 1; the mean over u is 1 - (1 - fan)^2.
double ShareSeenInTurning(const SonarOptions& sonar, const MotionLimits& limits) {
  const double fov_rad = ToRadians(sonar.fov_deg);
  const double is_new = std::min(1.0, YawOfHeading(1) / fov_rad);
  const double turned_rad = limits.max_yaw_rate_rad_s * SweepPeriod_s(sonar);
  const double fan = std::min(1.0, fov_rad / std::max(turned_rad, 1e-9));
  return is_new * (1 - (1 - fan) * (1 - fan));
}

}  // namespace

CoveragePlanner::CoveragePlanner(const PlannerOptions& options, const MotionLimits& limits,
                                 const SonarOptions& sonar, const Eigen::AlignedBox3d& box_W,
                                 std::int64_t seed)
    : options_(options),
      limits_(limits),
      box_W_(box_W),
      seed_(seed),
      turn_on_s_(YawOfHeading(1) / limits.max_yaw_rate_rad_s),
      turn_on_share_(ShareSeenInTurning(sonar, limits)),
      view_(sonar, options.range_m, options.ray_step_deg, box_W),
      panorama_(sonar, options.range_m, box_W),
      looked_at_(box_W, LooksInVain(sonar)),
      routes_(options, limits, box_W) {}

void CoveragePlanner::Look(const OccupancyMap& map, const Waypoint& at) {
  looked_at_.Note(map.grid(), view_.See(map, at));
  looks_left_ = kNewPlaces;
  LookAtNewPlaces(map, 0);
}

double CoveragePlanner::WeightOf(const VoxelKey& key) const {
  if (looked_at_.IsInVain(key)) return 0;
  return routes_.free_places().IsNextToOccupied(key) ? options_.surface_weight : 1;
}

OccupancyMap::EndsRay CoveragePlanner::WhereSurfacesGoOn() const {
  if (looks_through_) return nullptr;
  return [this](const VoxelKey& key) { return routes_.free_places().IsNextToOccupied(key); };
}

double CoveragePlanner::GainAt(const OccupancyMap& map, const Waypoint& at) const {
  double gain = 0;
  int voxels = 0;
  for (const VoxelKey& key : view_.See(map, at, WhereSurfacesGoOn())) {
    const double weight = WeightOf(key);
    gain += weight;
    voxels += weight > 0;
  }
  return voxels < options_.zero_gain_voxels ? 0 : gain;
}

bool CoveragePlanner::IsObsolete(const OccupancyMap& map, const std::vector<Waypoint>& path,
                                 int visible) const {
  return GainAt(map, path.back()) < kShareLeft * visible;
}

CoveragePlanner::Known& CoveragePlanner::KnownOf(const Reached& reached) {
  return reached.place < 0 ? known_.back() : known_[static_cast<std::size_t>(reached.place)];
}

void CoveragePlanner::LookFrom(const OccupancyMap& map, const Reached& reached,
                               const OccupancyMap::EndsRay& ends) {
  --looks_left_;
  Known& known = KnownOf(reached);
  known.gain = panorama_.Look(
      map, routes_.PositionOf(reached), [this](const VoxelKey& key) { return WeightOf(key); },
      ends);
  known.in_plan = plans_;
}

void CoveragePlanner::SearchFrom(const OccupancyMap& map, const Reached& reached) {
  LookFrom(map, reached, nullptr);
  Known& known = KnownOf(reached);
  if (IsEmpty(known)) {
    known.empty_in_plan = plans_;
  } else if (!looks_through_) {
    LookFrom(map, reached, WhereSurfacesGoOn());
  }
}

bool CoveragePlanner::IsEmpty(const Known& known) const {
  return *std::max_element(known.gain.begin(), known.gain.end()) < options_.zero_gain_voxels;
}

bool CoveragePlanner::IsSearched(const Reached& reached) {
  const Known& known = KnownOf(reached);
  return nothing_since_ >= 0 &&
         (known.empty_in_plan >= nothing_since_ || known.in_plan >= searched_since_);
}

double CoveragePlanner::ViewTime_s(const Reached& reached, int heading, const Waypoint& at) {
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
  return options_.view_time_s + flight_s;
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

double CoveragePlanner::GainOf(const Reached& reached, int heading) {
  const double voxels = KnownOf(reached).gain[static_cast<std::size_t>(heading)];
  return voxels < options_.zero_gain_voxels ? 0 : voxels;
}

CoveragePlanner::View CoveragePlanner::BestTurnOn(int index, int heading, int side, double time_s) {
  const Reached& reached = routes_.reached()[static_cast<std::size_t>(index)];
  View best{.reached = index};
  double voxels = GainOf(reached, heading);
  for (int turns = 0; turns <= kMostTurnsOn; ++turns) {
    View view{index, heading, side * turns};
    const int last = view.last_heading();
    if ((reached.arc >> last & 1) == 0) break;
    const double gain = GainOf(reached, last);
    if (turns > 0) voxels += turn_on_share_ * gain;
    view.utility = voxels / (time_s + turns * turn_on_s_);
    if (gain > 0 && view.utility > best.utility) best = view;
  }
  return best;
}

CoveragePlanner::View CoveragePlanner::BestViewAt(int index, const Waypoint& at) {
  const Reached& reached = routes_.reached()[static_cast<std::size_t>(index)];
  View best{.reached = index};
  if (IsGivenUp(reached.place) || IsEmpty(KnownOf(reached))) return best;
  for (int heading = 0; heading < kHeadings; ++heading) {
    if ((reached.arc >> heading & 1) == 0) continue;
    const double time_s = ViewTime_s(reached, heading, at);
    for (const int side : {1, -1}) {
      const View view = BestTurnOn(index, heading, side, time_s);
      if (view.utility > best.utility) best = view;
    }
  }
  return best;
}

void CoveragePlanner::LookAtNewPlaces(const OccupancyMap& map, int looks_to_leave) {
  for (const Reached& reached : routes_.reached()) {
    if (KnownOf(reached).in_plan >= 0) continue;
    if (looks_left_ <= looks_to_leave) return;
    LookFrom(map, reached, WhereSurfacesGoOn());
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
    View view = queue.top();
    queue.pop();
    const Reached& reached = routes_.reached()[static_cast<std::size_t>(view.reached)];
    if (KnownOf(reached).in_plan != plans_ && !IsSearched(reached)) {
      if (looks_left_ <= kLastPlaces) break;
      LookFrom(map, reached, WhereSurfacesGoOn());
    } else if (KnownOf(reached).ahead_in_plan == plans_ ||
               !MustGoAhead(map, checker, at, reached)) {
      // Where the panorama promises something, look with all rays.
      const Waypoint to{routes_.PositionOf(reached), YawOfHeading(view.last_heading())};
      const double gain = GainAt(map, to);
      float& promised = KnownOf(reached).gain[static_cast<std::size_t>(view.last_heading())];
      if (gain > 0 && gain >= promised / 2) {
        view.gain = gain;
        return view;
      }
      promised = static_cast<float>(gain);
    }
    const View again = BestViewAt(view.reached, at);
    if (again.utility > 0) queue.push(again);
  }
  return {};
}

std::optional<std::vector<Waypoint>> CoveragePlanner::WayTo(const OccupancyMap& map,
                                                            const CollisionChecker& checker,
                                                            const View& view) {
  auto way = routes_.RouteTo(map, checker, view.reached, YawOfHeading(view.heading));
  if (!way) return way;
  const std::size_t to_heading = way->size();
  constexpr int kAtOnce = kHeadings / 4;  // Of less than half a turn it is clear which way it goes.
  const int side = view.turns_on < 0 ? -1 : 1;
  for (int left = std::abs(view.turns_on); left > 0;) {
    left -= std::min(left, kAtOnce);
    const Waypoint turned{way->back().position_W_m,
                          YawOfHeading(view.last_heading() - side * left)};
    if (!checker.IsEdgeFree(map, way->back(), turned)) break;
    way->push_back(turned);
  }
  const Reached& reached = routes_.reached()[static_cast<std::size_t>(view.reached)];
  const bool has_turned = way->size() > to_heading;
  if (has_turned || view.turns_on == 0 || GainOf(reached, view.heading) > 0) return way;
  routes_.RefuseTurnAt(view.reached);
  return std::nullopt;
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
  plan.tree.back().visible = static_cast<int>(view.gain);
  plan.tree.back().gain = view.utility;
  plan.best = static_cast<int>(plan.tree.size()) - 1;
  plan.path = FirstPartOf(way, options_.max_edge_m);
  return plan;
}

ViewPlan CoveragePlanner::LookForMore(const OccupancyMap& map) {
  ViewPlan plan;
  plan.outcome = ViewPlan::Outcome::kNothing;
  if (nothing_since_ < 0) nothing_since_ = searched_since_ = plans_;
  for (const Reached& reached : routes_.reached()) {
    if (IsSearched(reached)) continue;
    plan.outcome = ViewPlan::Outcome::kLookOn;
    if (looks_left_ <= 0) break;
    SearchFrom(map, reached);
  }
  if (plan.outcome == ViewPlan::Outcome::kNothing && !looks_through_) {
    looks_through_ = true;
    searched_since_ = plans_ + 1;
    plan.outcome = ViewPlan::Outcome::kLookOn;
  }
  return plan;
}

ViewPlan CoveragePlanner::GrowTree(const OccupancyMap& map, const CollisionChecker& checker,
                                   const Waypoint& at) {
  // The same tree in each plan, as far as the map is the same; it grows from plan to plan, and what
  // it grew by is looked at.
  const int first = tree_views_;
  tree_views_ = std::min(first + kTreeViews, options_.max_tree_nodes);
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
  tree.GrowTo(context, tree_views_, random);
  // Where there is little room, all samples are tried before it counts as all that can be reached.
  if (view < tree_views_) tree.GrowTo(context, options_.max_tree_nodes, random);
  ViewPlan plan = PlanOf(tree);
  if (plan.outcome != ViewPlan::Outcome::kGo) {
    const bool is_all = view < tree_views_ || tree_views_ == options_.max_tree_nodes;
    if (is_all) {
      tree_views_ = 0;
    } else {
      plan.outcome = ViewPlan::Outcome::kLookOn;
    }
    return plan;
  }
  NoteGain();
  plan.path = FirstPartOf(plan.path, options_.max_edge_m);
  return plan;
}

bool CoveragePlanner::IsGivenUp(int place) const {
  const auto refusals = refusals_.find(place);
  return refusals != refusals_.end() && refusals->second >= kMostRefusals;
}

void CoveragePlanner::NoteGain() {
  refusals_.clear();
  nothing_since_ = -1;
  tree_views_ = 0;
}

ViewPlan CoveragePlanner::Plan(const OccupancyMap& map, const CollisionChecker& checker,
                               const Waypoint& at) {
  ++plans_;
  looks_left_ = kPlaces;
  routes_.Search(map, checker, at);
  const bool is_confined =
      routes_.reached().front().arc != kAllHeadings && routes_.reached().size() < kFewPlaces;
  known_.resize(static_cast<std::size_t>(routes_.free_places().places()) + 1);
  LookFrom(map, routes_.reached().front(), WhereSurfacesGoOn());
  LookAtNewPlaces(map, kPlaces - kNewPlaces);
  ViewPlan plan = FindPlan(map, checker, at);
  plan.is_confined = is_confined;
  return plan;
}

ViewPlan CoveragePlanner::FindPlan(const OccupancyMap& map, const CollisionChecker& checker,
                                   const Waypoint& at) {
  bool was_refused = false;
  for (int tries = 0; tries < kWays; ++tries) {
    const View view = FindBest(map, checker, at);
    if (view.reached < 0) break;
    const int place = routes_.reached()[static_cast<std::size_t>(view.reached)].place;
    const auto way = WayTo(map, checker, view);
    if (way) {
      NoteGain();
      return GoTo(view, *way);
    }
    was_refused = true;
    ++refusals_[place];
  }
  ViewPlan plan = LookForMore(map);
  if (plan.outcome == ViewPlan::Outcome::kNothing) plan = GrowTree(map, checker, at);
  if (plan.outcome == ViewPlan::Outcome::kNothing && was_refused)
    plan.outcome = ViewPlan::Outcome::kLookOn;
  return plan;
}

}  // namespace vog
