#include "lib/planner/explorer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "lib/occupancy/frontiers.h"
#include "lib/planner/flown_step.h"

namespace vog {
namespace {

constexpr Duration kCheckPeriod = std::chrono::seconds(1);
constexpr Duration kLookPeriod = std::chrono::seconds(1);
/// Beside the fan, what counts as looked into near a start: half the hull's front.
constexpr double kBubbleBeside_rad = std::numbers::pi / 4;
constexpr double kBubblePlay_m = 0.15;
constexpr Duration kPlanTimeout = std::chrono::seconds(60);
constexpr double kHistoryStep_m = 0.5;
constexpr double kHistoryStep_rad = 0.5;
constexpr double kRevisitProgress_m = 0.3;
/// While old places are visited, to look again when there are so many times as many submaps as when
/// nothing was left to gain: what was closed may be open.
constexpr double kLookAgain = 1.25;
/// A visit that brings no submap about ends after the time that so many take.
constexpr double kMaxVisitSubmaps = 4;
/// A loop was closed when less than this share of what was expected is still to be gained.
constexpr double kStillToGain = 0.5;
/// Submaps that may fail to: the first was begun on the way.
constexpr int kSubmapsOfAVisit = 3;
constexpr Duration kHoldTime = std::chrono::seconds(2);
constexpr int kMaxFailures = 30;
/// The vehicle is at home when it is this near.
constexpr double kHome_m = 0.5;
/// Places near a goal that a way is looked for to.
constexpr int kPlacesTried = 20;
/// Where the clearances are not kept, a place with room for them is looked for this near.
constexpr double kRoom_m = 3;
constexpr const char* kNothingToGain = "nothing_to_gain";
// Share of what was unseen at the last second look at home, to look once more.
constexpr double kLessUnseen = 0.9;
/// A map that closes every way soon after it was begun keeps nobody from an end.
constexpr int kMaxWaysHome = 100;

// Shares of the clearances that a place may offer, and the least that a plan keeps to when the
// vehicle finds itself inside its clearances.
constexpr double kShares[] = {1, 0.75, 0.5, 0.25};
constexpr double kLeastShare = 0.5;
// And that a way back keeps from what is surely there, and from what is not: distance from walls
// that may be elsewhere is given up first, but not all of it at once.
constexpr double kWayBackShares[] = {1, 0.5, 0.25, 0}, kUnsureShares[] = {1, 0.5, 0.25, 0};
/// Where the distance that uncertainty asks for leaves less than a share of the known water open,
/// so much of it is kept instead, until so many submaps later.
constexpr double kLessDistance = 0.5, kWalledIn = 0.4;
constexpr int kSubmapsOfLessDistance = 2;
// Half the clearance that was planned with is the controller's and the drift's to use up.
constexpr double kFlightShare = 0.5;

/// Way and turn as one number, to tell which part of a path the vehicle is on.
double WayOf(const Waypoint& from, const Waypoint& to) {
  constexpr double kTurn_m = 0.5;  // What a radian counts like.
  return LengthOf(from, to) + kTurn_m * std::abs(WrapAngle(to.yaw_rad - from.yaw_rad));
}

}  // namespace

Explorer::Explorer(const PlannerOptions& options, const MotionLimits& limits,
                   const ExplorationOptions& exploration, const SonarOptions& sonar,
                   const MissionOptions& mission)
    : limits_(limits), sonar_(sonar), mission_(mission), checker_(options.collision_rules()) {
  SetRules(options, exploration);
}

Explorer::~Explorer() = default;

void Explorer::SetRules(const PlannerOptions& options, const ExplorationOptions& exploration) {
  options_ = options;
  exploration_ = exploration;
  box_W_ = exploration.box_W();
  SetDistance(1);
  if (!bubbles_.empty()) {
    const Vec3 first_W = bubbles_.front().center_W_m, start_W = bubbles_.back().center_W_m;
    SetStart(first_W, start_W);
  }
  revisits_.emplace(options.revisit_share, limits_);
  routes_ = std::make_unique<Routes>(options, limits_, box_W_);
  planner_ = MakeViewPlanner(options, limits_, sonar_, box_W_, mission_.seed);
  if (state_ != ExplorerState::kFinished) plan_.reset();
}

void Explorer::SetStart(const Vec3& first_W, const Vec3& p_W) {
  home_W_ = exploration_.home == HomePlace::kStart ? first_W : exploration_.home_m;
  // Until LookIntoBubbles() nothing of them is free.
  bubbles_.resize(first_W == p_W ? 1 : 2, FreeBubble{.core_radius_m = 0});
  bubbles_.front().center_W_m = first_W;
  bubbles_.back().center_W_m = p_W;
  for (FreeBubble& bubble : bubbles_) bubble.radius_m = options_.bubble_radius_m;
  checker_.SetBubbles(bubbles_);
}

void Explorer::SetDistance(double share) {
  distance_share_ = share;
  set_distance_at_ = submaps_;
  checker_ = CollisionChecker(options_.collision_rules()).GrowingBy(share);
  checker_.SetKeepOut(exploration_.keep_out_W());
  checker_.SetBubbles(bubbles_);
}

bool Explorer::IsWalledIn(const OccupancyMap& map, const Waypoint& at) {
  const auto reached_by = [&](const CollisionChecker& checker) {
    routes_->Search(map, checker, at);
    return static_cast<double>(routes_->reached().size());
  };
  const CollisionChecker checker = CheckerAt(map, at, 1);
  const double open = reached_by(checker.GrowingBy(0)), left = reached_by(checker);
  return left < kWalledIn * open;
}

bool Explorer::KeepLessDistance(const OccupancyMap& map, const Waypoint& at) {
  if (distance_share_ < 1 || !IsWalledIn(map, at)) return false;
  SetDistance(kLessDistance);
  return true;
}

bool Explorer::MayWallsBeElsewhere(const OccupancyMap& map) const {
  return options_.uncertainty_sigmas * map.max_sigma_m() >= map.grid().voxel_size_m();
}

bool Explorer::IsHemmedIn(const OccupancyMap& map, const CollisionChecker& checker,
                          const Waypoint& at) {
  if (!MayWallsBeElsewhere(map)) return false;
  routes_->Search(map, checker, at);
  return routes_->reached().size() == 1;
}

void Explorer::KeepAllDistance(const OccupancyMap& map, const Waypoint& at) {
  // Not while it leads nowhere: the end of that is counted.
  if (distance_share_ == 1 || failures_ > 0 || submaps_ - set_distance_at_ < kSubmapsOfLessDistance)
    return;
  SetDistance(1);
  if (!checker_.IsFree(map, at)) SetDistance(kLessDistance);
}

Random Explorer::NextRandom() {
  return Random(static_cast<std::uint64_t>(mission_.seed), "explorer",
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

const Plan* Explorer::Update(const OccupancyMap& map, const Pose3& X_WB, Time now, int submaps,
                             const std::string& hold) {
  if (state_ == ExplorerState::kFinished) return nullptr;
  const Waypoint at = WaypointOf(X_WB);
  const std::int64_t before = plans_;
  now_ = now;
  submaps_ = submaps;
  Remember(at);
  SpendBudget(at, now, submaps);
  if (!Hold(hold, at) && state_ != ExplorerState::kFinished) {
    LookAround(map, at, now);
    if (NeedsPlan(map, at, now)) {
      MakePlan(map, at);
      planned_at_ = checked_at_ = now;
    }
  }
  return plans_ != before ? plan() : nullptr;
}

bool Explorer::Hold(const std::string& reason, const Waypoint& at) {
  if (!reason.empty() && hold_.empty()) {
    planner_->Forget();
    SetPlan({at}, PlanKind::kSearch);
  }
  hold_ = reason;
  return !hold_.empty();
}

void Explorer::SpendBudget(const Waypoint& at, Time now, int submaps) {
  if (!started_at_) {
    started_at_ = now;
    earlier_submaps_ = submaps;
  }
  if (last_at_) flown_m_ += LengthOf(*last_at_, at);
  last_at_ = at;
  if (state_ == ExplorerState::kReturning) return;
  const auto is_used = [](double most, double used) { return most > 0 && used >= most; };
  const char* reason = submaps >= mission_.max_submaps ? "max_submaps"
                       : is_used(mission_.max_duration_s, ToSeconds(now - *started_at_))
                           ? "max_duration"
                       : is_used(mission_.max_distance_m, flown_m_) ? "max_distance"
                                                                    : nullptr;
  if (reason != nullptr) EndWith(reason, mission_.when_done == WhenDone::kReturn);
}

void Explorer::EndWith(const std::string& reason, bool goes_home) {
  if (state_ == ExplorerState::kFinished || !last_at_) return;
  if (end_reason_.empty()) end_reason_ = reason;
  planner_->Forget();
  visit_.reset();
  failures_ = 0;
  if (!goes_home || !home_W_) {
    Finish(*last_at_);
    return;
  }
  state_ = ExplorerState::kReturning;
  SetDistance(1);
  plan_.reset();
}

void Explorer::LookAround(const OccupancyMap& map, const Waypoint& at, Time now) {
  if (state_ != ExplorerState::kExploring && state_ != ExplorerState::kLocalising) return;
  if (looked_at_ && now - *looked_at_ < kLookPeriod) return;
  looked_at_ = now;
  planner_->Look(map, at);
  LookIntoBubbles(map, at);
}

void Explorer::LookIntoBubbles(const OccupancyMap& map, const Waypoint& at) {
  // A turn must be possible, also a little beside the start.
  const Eigen::Vector2d turned_m =
      0.5 * options_.hull_size_m.head<2>() +
      Eigen::Vector2d::Constant(options_.unknown_clearance_m + 0.5 * map.grid().voxel_size_m());
  for (FreeBubble& bubble : bubbles_) {
    bubble.core_radius_m = turned_m.norm() + kBubblePlay_m;
    if ((at.position_W_m - bubble.center_W_m).norm() < bubble.core_radius_m)
      bubble.LookInto(at.yaw_rad, ToRadians(sonar_.fov_deg) / 2 + kBubbleBeside_rad);
  }
  checker_.SetBubbles(bubbles_);
}

bool Explorer::NeedsPlan(const OccupancyMap& map, const Waypoint& at, Time now) {
  if (!plan_ || kind_ == PlanKind::kSearch || now - planned_at_ > kPlanTimeout) return true;
  if (kind_ == PlanKind::kHold) return now - planned_at_ > kHoldTime;
  if (HasReached(at)) return true;
  if (visit_ && visit_->arrived && IsVisitOver()) return true;
  if (now - checked_at_ < kCheckPeriod) return false;
  checked_at_ = now;
  return IsBlocked(map, at) || (state_ == ExplorerState::kExploring && kind_ == PlanKind::kPath &&
                                planner_->IsObsolete(map, plan_->path, VisibleAtItsEnd()));
}

int Explorer::VisibleAtItsEnd() const {
  return plan_->best < 0 ? 0 : plan_->tree[static_cast<std::size_t>(plan_->best)].visible;
}

bool Explorer::HasReached(const Waypoint& at) const {
  const Waypoint& goal = plan_->path.back();
  return LengthOf(at, goal) < options_.goal_tolerance_m &&
         std::abs(WrapAngle(goal.yaw_rad - at.yaw_rad)) < options_.goal_tolerance_rad;
}

bool Explorer::IsBlocked(const OccupancyMap& map, const Waypoint& at) const {
  const CollisionChecker checker =
      kind_ == PlanKind::kWayBack
          ? WayBackChecker(map, at, {flight_share_, flight_unsure_share_}).PassingUnknown()
          : CheckerAt(map, at, flight_share_);
  // The rest of the path begins behind the waypoint that the vehicle is nearest to leaving.
  const std::vector<Waypoint>& path = plan_->path;
  std::size_t next = path.size() - 1;
  double least_m = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double detour_m =
        WayOf(path[i], at) + WayOf(at, path[i + 1]) - WayOf(path[i], path[i + 1]);
    if (detour_m < least_m - 1e-6) {
      least_m = detour_m;
      next = i + 1;
    }
  }
  Waypoint from = at;
  for (std::size_t i = next; i < path.size(); ++i) {
    if (!checker.IsEdgeFree(map, from, path[i])) return true;
    from = path[i];
  }
  return false;
}

void Explorer::MakePlan(const OccupancyMap& map, const Waypoint& at) {
  bool found = false;
  if (state_ == ExplorerState::kLocalising) found = Localise(map, at);
  if (state_ == ExplorerState::kExploring) found = Explore(map, at);
  if (state_ == ExplorerState::kRevisiting) found = Revisit(map, at);
  if (state_ == ExplorerState::kReturning) found = ReturnHome(map, at);
  if (state_ == ExplorerState::kFinished) return;
  if (found) {
    failures_ = 0;
    return;
  }
  if (LeaveTightPlace(map, at, &Explorer::BackOut)) return;
  if (++failures_ <= kMaxFailures) {
    if (LeaveTightPlace(map, at, &Explorer::Escape)) return;
    // By turns: a step helps where it is tight, a turn where too little was seen.
    if (failures_ % 2 == 1 && MayWallsBeElsewhere(map) &&
        LeaveTightPlace(map, at, &Explorer::TurnOn))
      return;
    if (LeaveTightPlace(map, at, &Explorer::StepAside)) return;
    SetPlan({at}, PlanKind::kHold);  // The next scans may clear what is in the way.
  } else if (state_ == ExplorerState::kReturning) {
    Finish(at);
  } else {
    EndWith("stuck", mission_.when_done == WhenDone::kReturn);
  }
}

CollisionChecker Explorer::CheckerAt(const OccupancyMap& map, const Waypoint& at,
                                     double share) const {
  CollisionChecker checker = checker_.Scaled(share);
  checker.SetPresence(at, map.grid().voxel_size_m());
  return checker;
}

double Explorer::FreeShareAt(const OccupancyMap& map, const Waypoint& at) const {
  for (const double share : kShares) {
    if (checker_.Scaled(share).IsFree(map, at)) return share;
  }
  return 0;
}

std::optional<CollisionChecker> Explorer::CheckerFor(const OccupancyMap& map, const Waypoint& at) {
  for (const double share : kShares) {
    const CollisionChecker checker = CheckerAt(map, at, share);
    if (share < kLeastShare || !checker.IsFree(map, at)) continue;
    flight_share_ = kFlightShare * share;
    return checker;
  }
  return std::nullopt;
}

bool Explorer::KeepsAllClearances() const { return flight_share_ >= kFlightShare; }

bool Explorer::IsUncertain(const OccupancyMap& map) const {
  return map.max_sigma_m() > options_.sure_sigma_m();
}

bool Explorer::Explore(const OccupancyMap& map, const Waypoint& at) {
  KeepAllDistance(map, at);
  const auto checker = CheckerFor(map, at);
  if (!checker) return false;
  if (!KeepsAllClearances() && IsUncertain(map) && MakeRoom(map, *checker, at)) return true;
  if (BeginVisit(map, *checker, at)) return true;
  ViewPlan found = planner_->Plan(map, *checker, at);
  if (found.is_confined && FlyCloser(map, at)) return true;
  switch (found.outcome) {
    case ViewPlan::Outcome::kGo:
      return FlyToView(map, *checker, std::move(found), at);
    case ViewPlan::Outcome::kLookOn:
      if (kind_ != PlanKind::kSearch) SetPlan({at}, PlanKind::kSearch);
      return true;
    case ViewPlan::Outcome::kNoWay:
      return false;
    case ViewPlan::Outcome::kNothing:
      break;
  }
  if (KeepLessDistance(map, at)) {
    SetPlan({at}, PlanKind::kSearch);
    return true;
  }
  if (failures_ < kMaxFailures && IsHemmedIn(map, *checker, at)) return false;
  unseen_ = CountUnseen(map);
  if (mission_.when_done == WhenDone::kRevisit) {
    state_ = ExplorerState::kRevisiting;
    done_at_ = submaps_;
    SetDistance(1);
  } else {
    EndWith(kNothingToGain, mission_.when_done == WhenDone::kReturn);
  }
  return false;
}

bool Explorer::FlyCloser(const OccupancyMap& map, const Waypoint& at) {
  if (IsUncertain(map) || flight_share_ <= kFlightShare * kLeastShare) return false;
  const CollisionChecker closer = CheckerAt(map, at, kLeastShare);
  ViewPlan found = planner_->Plan(map, closer, at);
  if (found.outcome != ViewPlan::Outcome::kGo || found.is_confined) return false;
  flight_share_ = kFlightShare * kLeastShare;
  return FlyToView(map, closer, std::move(found), at);
}

bool Explorer::FlyToView(const OccupancyMap& map, const CollisionChecker& checker, ViewPlan found,
                         const Waypoint& at) {
  std::vector<Waypoint> path = FlownPath(map, checker, found.path, Refused::kEndsThePath);
  if (path.size() == 1 && !IsSame(path.back(), found.path.back())) return false;
  SetPlan(std::move(path), PlanKind::kPath, std::move(found.tree), found.best);
  if (HasReached(at)) kind_ = PlanKind::kHold;
  return true;
}

std::optional<bool> Explorer::ExploreAgain(const OccupancyMap& map, const Waypoint& at) {
  const ExplorerState before = std::exchange(state_, ExplorerState::kExploring);
  end_reason_.clear();
  const bool found = Explore(map, at);
  return !found && state_ == before ? std::nullopt : std::optional(found);
}

bool Explorer::MakeRoom(const OccupancyMap& map, const CollisionChecker& checker,
                        const Waypoint& at) {
  routes_->Search(map, checker, at);
  const std::vector<Reached>& reached = routes_->reached();
  for (std::size_t i = 1; i < reached.size(); ++i) {
    if (reached[i].time_s * limits_.max_speed_m_s > kRoom_m) break;
    const double yaw_rad = YawOfHeading(NearestHeading(reached[i].arc, at.yaw_rad));
    if (!checker_.IsFree(map, {routes_->PositionOf(reached[i]), yaw_rad})) continue;
    const auto way = routes_->RouteTo(map, checker, static_cast<int>(i), yaw_rad);
    if (way) SetPlan(*way, PlanKind::kPath);
    return way.has_value();
  }
  return false;
}

Unseen Explorer::CountUnseen(const OccupancyMap& map) const {
  const VoxelBox box = VoxelsOf(map.grid(), box_W_);
  std::set<VoxelKey> beside;
  for (const auto& [x, y, z] : FrontiersIn(map, box))
    beside.insert(
        {{x - 1, y, z}, {x + 1, y, z}, {x, y - 1, z}, {x, y + 1, z}, {x, y, z - 1}, {x, y, z + 1}});
  const std::vector<VoxelKey> voxels(beside.begin(), beside.end());
  std::vector<float> log_odds(voxels.size());
  map.LogOddsOf(voxels, log_odds);
  Unseen unseen;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (IsKnown(log_odds[i]) || !box.Contains(voxels[i])) continue;
    ++unseen.voxels;
    unseen.in_vain += planner_->IsInVain(voxels[i]);
  }
  return unseen;
}

bool Explorer::IsWorthASecondLook() {
  if (end_reason_ != kNothingToGain ||
      static_cast<double>(unseen_.voxels) >= kLessUnseen * unseen_at_home_)
    return false;
  unseen_at_home_ = static_cast<double>(unseen_.voxels);
  return true;
}

bool Explorer::ReturnHome(const OccupancyMap& map, const Waypoint& at) {
  if ((at.position_W_m - *home_W_).norm() < kHome_m) {
    if (IsWorthASecondLook()) {
      if (const auto found = ExploreAgain(map, at)) return *found;
    }
    const auto checker = CheckerFor(map, at);
    revisits_->LookAgain();
    if (checker && end_reason_ == kNothingToGain && BeginVisit(map, *checker, at)) return true;
    is_home_ = true;
    Finish(at);
    return true;
  }
  if (ways_home_ == kMaxWaysHome) return false;
  const auto checker = CheckerFor(map, at);
  if (checker && FlyHome(map, *checker, at)) return true;
  return IsUncertain(map) && FeelHome(map, at);
}

bool Explorer::FlyHome(const OccupancyMap& map, const CollisionChecker& checker,
                       const Waypoint& at) {
  auto way = WayHome(map, checker, at);
  if (!way) return false;
  if (!KeepsAllClearances()) way = FirstPartOf(*way, options_.max_edge_m);
  SetPlan(std::move(*way), PlanKind::kPath);
  return true;
}

bool Explorer::FeelHome(const OccupancyMap& map, const Waypoint& at) {
  for (const double unsure : kUnsureShares) {
    for (const double share : kWayBackShares) {
      if (share < kLeastShare) break;
      const CollisionChecker checker = WayBackChecker(map, at, {share, unsure});
      const auto way = WayHome(map, checker, at);
      if (!way) continue;
      KeepInFlight({share, unsure});
      SetPlan(FirstPartOf(*way, options_.max_edge_m), PlanKind::kWayBack);
      return true;
    }
  }
  return false;
}

std::optional<std::vector<Waypoint>> Explorer::WayHome(const OccupancyMap& map,
                                                       const CollisionChecker& checker,
                                                       const Waypoint& at) {
  routes_->Search(map, checker, at);
  auto way = WayTo(map, checker, {*home_W_, at.yaw_rad}, kHome_m, kAllHeadings);
  if (way) ++ways_home_;
  return way;
}

std::optional<std::vector<Waypoint>> Explorer::WayTo(const OccupancyMap& map,
                                                     const CollisionChecker& checker,
                                                     const Waypoint& goal, double near_m,
                                                     HeadingSet headings) {
  for (int tries = 0; tries < kPlacesTried; ++tries) {
    const auto place = routes_->ReachedNear(goal.position_W_m, near_m, headings);
    if (!place) return std::nullopt;
    if (auto way = routes_->RouteTo(map, checker, *place, goal.yaw_rad)) return way;
  }
  return std::nullopt;
}

bool Explorer::BeginVisit(const OccupancyMap& map, const CollisionChecker& checker,
                          const Waypoint& at) {
  // Nobody asks for the flight: it keeps to all of the clearances.
  const FlightTime time = TimeSpent();
  if (!KeepsAllClearances() || !revisits_->IsNew() || !revisits_->IsWorthASearch(at, time))
    return false;
  routes_->Search(map, checker, at);
  const auto place = revisits_->Best(*routes_, time);
  if (!place) return false;
  visit_ = Visit{*place, state_, now_};
  if (!FlyToVisit(map, checker)) {
    visit_.reset();
    return false;
  }
  revisits_->NoteTried(place->submap, time);
  state_ = ExplorerState::kLocalising;
  return true;
}

bool Explorer::FlyToVisit(const OccupancyMap& map, const CollisionChecker& checker) {
  const Waypoint& first = visit_->place.first;
  auto way = WayTo(map, checker, first, kRevisitNear_m, 1u << HeadingOfYaw(first.yaw_rad));
  if (!way) return false;
  // The lattice ends beside the place; the vehicle fitted there once.
  if (checker.IsEdgeFree(map, way->back(), first)) way->push_back(first);
  SetPlan(std::move(*way), PlanKind::kPath);
  return true;
}

FlightTime Explorer::TimeSpent() const {
  const double all_s = ToSeconds(now_ - *started_at_);
  return {all_s, visits_s_, all_s / std::max(1, submaps_ - earlier_submaps_)};
}

bool Explorer::Localise(const OccupancyMap& map, const Waypoint& at) {
  const auto checker = CheckerFor(map, at);
  if (!checker) return false;
  const Waypoint& first = visit_->place.first;
  const bool is_there =
      LengthOf(at, first) < kRevisitNear_m + options_.goal_tolerance_m &&
      std::abs(WrapAngle(first.yaw_rad - at.yaw_rad)) < options_.goal_tolerance_rad;
  if (!visit_->arrived && is_there) {
    visit_->arrived = now_;
    visit_->submaps_at_arrival = submaps_;
  }
  if (!visit_->arrived && KeepsAllClearances()) {
    routes_->Search(map, *checker, at);
    if (FlyToVisit(map, *checker)) return true;
  }
  if (!visit_->arrived || IsVisitOver()) {
    EndVisit();
    return false;
  }
  SetSweep(map, *checker, at);
  return true;
}

bool Explorer::IsVisitOver() const {
  const auto& [submap, first, last, gain] = visit_->place;
  return revisits_->GainOf(submap) < kStillToGain * gain ||
         submaps_ - visit_->submaps_at_arrival >= kSubmapsOfAVisit ||
         ToSeconds(now_ - *visit_->arrived) > kMaxVisitSubmaps * TimeSpent().submap_s;
}

void Explorer::SetSweep(const OccupancyMap& map, const CollisionChecker& checker,
                        const Waypoint& at) {
  const auto& [submap, first, last, gain] = visit_->place;
  const bool is_far = LengthOf(first, last) > options_.goal_tolerance_m;
  if (is_far && checker.IsEdgeFree(map, at, last) && checker.IsEdgeFree(map, last, at)) {
    SetPlan({at, last, {at.position_W_m, first.yaw_rad}}, PlanKind::kPath);
    return;
  }
  const Waypoint turned{at.position_W_m, first.yaw_rad};
  SetPlan(checker.IsEdgeFree(map, at, turned) ? std::vector{at, turned} : std::vector{at},
          PlanKind::kHold);
}

void Explorer::EndVisit() {
  visits_s_ += ToSeconds(now_ - visit_->began);
  state_ = visit_->then;
  visit_.reset();
}

bool Explorer::Revisit(const OccupancyMap& map, const Waypoint& at) {
  if (submaps_ > kLookAgain * done_at_) {
    if (const auto found = ExploreAgain(map, at)) return *found;
  }
  const auto checker = CheckerFor(map, at);
  if (!checker) return false;
  const TreeContext context{map, *checker, {}};
  for (std::size_t tries = 0; tries < history_.size(); ++tries) {
    const Waypoint target = history_[next_revisit_ % history_.size()].at;
    Random random = NextRandom();
    NbvTree tree(options_, box_W_, at);
    const int node = tree.GrowToward(context, target, options_.tree_nodes, random);
    const double left_m = LengthOf(tree.nodes()[node].at, target);
    const auto path = FlownPath(map, *checker, tree.BranchTo(node), Refused::kEndsThePath);
    const bool gets_nearer = left_m < LengthOf(at, target) - kRevisitProgress_m && path.size() > 1;
    if (!gets_nearer || left_m < kRevisitProgress_m) ++next_revisit_;
    if (!gets_nearer) continue;
    SetPlan(path, PlanKind::kPath, tree.nodes(), node);
    return true;
  }
  return false;
}

void Explorer::KeepInFlight(const WayBackShares& shares) {
  flight_share_ = kFlightShare * shares.from_sure;
  flight_unsure_share_ = kFlightShare * shares.from_unsure;
}

CollisionChecker Explorer::WayBackChecker(const OccupancyMap& map, const Waypoint& at,
                                          const WayBackShares& shares) const {
  const double unsure = shares.from_sure > 0 ? shares.from_unsure / shares.from_sure : 0;
  CollisionChecker checker =
      checker_.Scaled(shares.from_sure).ForSure(options_.sure_sigma_m(), unsure);
  // What the map shows inside the hull cannot be there: voxels that overlap it, however it is
  // turned, and none beside it.
  checker.SetPresence(at, std::numbers::sqrt2 / 2 * map.grid().voxel_size_m(),
                      CollisionChecker::Presence::kCoversOccupied);
  return checker;
}

bool Explorer::LeaveTightPlace(const OccupancyMap& map, const Waypoint& at, WayOut way_out) {
  for (const double unsure : kUnsureShares) {
    for (const double share : kWayBackShares) {
      if (share < unsure) break;
      if (!(this->*way_out)(map, at, WayBackChecker(map, at, {share, unsure}))) continue;
      KeepInFlight({share, unsure});
      return true;
    }
  }
  return false;
}

bool Explorer::BackOut(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& rules) {
  const CollisionChecker checker = rules.PassingUnknown();  // It was free when the vehicle came.
  std::vector<Waypoint> path = {at};
  for (auto back = history_.rbegin(); back != history_.rend(); ++back) {
    if (!checker.IsEdgeFree(map, path.back(), back->at)) return false;
    path.push_back(back->at);
    if (LengthOf(at, back->at) < kHistoryStep_m || FreeShareAt(map, back->at) < kLeastShare)
      continue;
    // From there the next way back goes on, never to and fro.
    history_.erase(back.base(), history_.end());
    SetWayBack(map, checker, path);
    return true;
  }
  return false;
}

bool Explorer::Escape(const OccupancyMap& map, const Waypoint& at,
                      const CollisionChecker& checker) {
  return SetWayToRoom(map, at, checker, kLeastShare, kHistoryStep_m);
}

bool Explorer::StepAside(const OccupancyMap& map, const Waypoint& at,
                         const CollisionChecker& checker) {
  return SetWayToRoom(map, at, checker, 0, 0);
}

bool Explorer::TurnOn(const OccupancyMap& map, const Waypoint& at,
                      const CollisionChecker& checker) {
  constexpr double kTurn_rad = std::numbers::pi / 4;
  for (int way_round = 0; way_round < 2; ++way_round) {
    const Waypoint turned{at.position_W_m, WrapAngle(at.yaw_rad + turn_sign_ * kTurn_rad)};
    if (checker.IsEdgeFree(map, at, turned)) {
      SetWayBack(map, checker, {at, turned});
      return true;
    }
    turn_sign_ = -turn_sign_;
  }
  return false;
}

bool Explorer::SetWayToRoom(const OccupancyMap& map, const Waypoint& at,
                            const CollisionChecker& checker, double least_share, double least_m) {
  const TreeContext context{map, checker, {}};
  Random random = NextRandom();
  NbvTree tree(options_, box_W_, at);
  tree.Spread(context, options_.tree_nodes, random);
  int best = 0;
  double best_share = FreeShareAt(map, at);
  for (int node = 1; node < static_cast<int>(tree.nodes().size()); ++node) {
    const Waypoint& there = tree.nodes()[node].at;
    const double share = FreeShareAt(map, there);
    if (share <= best_share || share < least_share || LengthOf(at, there) < least_m) continue;
    best = node;
    best_share = share;
  }
  if (best == 0) return false;
  SetWayBack(map, checker, tree.BranchTo(best), tree.nodes(), best);
  return true;
}

void Explorer::SetWayBack(const OccupancyMap& map, const CollisionChecker& checker,
                          const std::vector<Waypoint>& path, std::vector<TreeNode> tree, int best) {
  planner_->Forget();
  std::vector<Waypoint> flown = FlownPath(map, checker, path, Refused::kIsFlownAsPlanned);
  // The turn at its end takes longer than the way there, and is worth it for its room alone.
  if (flown.size() > 2 && LengthOf(flown.back(), flown[flown.size() - 2]) < 1e-9 &&
      FreeShareAt(map, flown[flown.size() - 2]) >= FreeShareAt(map, flown.back()))
    flown.pop_back();
  SetPlan(std::move(flown), PlanKind::kWayBack, std::move(tree), best);
}

void Explorer::SetPlan(std::vector<Waypoint> path, PlanKind kind, std::vector<TreeNode> tree,
                       int best) {
  plan_ = Plan{++plans_, std::move(path), std::move(tree), best};
  kind_ = kind;
}

void Explorer::Finish(const Waypoint& at) {
  state_ = ExplorerState::kFinished;
  SetPlan({at}, PlanKind::kHold);
}

void Explorer::Remember(const Waypoint& at) {
  if (plan_ && kind_ == PlanKind::kWayBack) return;
  if (!history_.empty() && LengthOf(history_.back().at, at) < kHistoryStep_m &&
      std::abs(WrapAngle(history_.back().at.yaw_rad - at.yaw_rad)) < kHistoryStep_rad)
    return;
  history_.push_back({at});
  if (X_WM_.empty()) return;
  const auto& [newest, X_WM] = *X_WM_.rbegin();
  history_.back().submap = newest;
  history_.back().X_MB = X_WM.inverse() * at.X_WB();
}

void Explorer::SetSubmaps(const std::map<int, Pose3>& X_WM) {
  X_WM_ = X_WM;
  for (Passed& passed : history_) {
    const auto submap = X_WM_.find(passed.submap);
    if (submap != X_WM_.end()) passed.at = WaypointOf(submap->second * passed.X_MB);
  }
}

}  // namespace vog
