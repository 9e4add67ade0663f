#include "lib/planner/routes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "lib/planner/flown_step.h"

namespace vog {
namespace {

constexpr double kSpacing_m = 0.4;
/// Places that are tried from where the vehicle is lie within this many steps of the lattice.
constexpr double kStartSteps = 1.6;
/// For how many searches a place stays blocked that the checker has refused once; then twice as
/// many.
constexpr int kRefusedSearches = 4, kMaxDoublings = 8;

}  // namespace

Routes::Routes(const PlannerOptions& options, const MotionLimits& limits,
               const Eigen::AlignedBox3d& box_W)
    : limits_(limits), free_(options.collision_rules(), box_W, kSpacing_m) {}

bool Routes::IsRefused(int from, int to) const {
  if (!has_refusals_[static_cast<std::size_t>(to)]) return false;
  const auto is_refused = [this](std::pair<int, int> places) {
    const auto refusal = refusals_.find(places);
    return refusal != refusals_.end() && refusal->second.until_search > searches_;
  };
  return is_refused(std::minmax(from, to)) || is_refused({to, to});
}

void Routes::Refuse(int from, int to) {
  if (to < 0) {
    reached_.front().arc = 1u << HeadingOfYaw(at_.yaw_rad);  // No turns on the spot.
    return;
  }
  has_refusals_[static_cast<std::size_t>(to)] = true;
  if (from >= 0) has_refusals_[static_cast<std::size_t>(from)] = true;
  Refusal& refusal = refusals_[std::minmax(from, to)];
  // The vehicle's own place is another one soon.
  const int doublings = from < 0 ? 0 : std::min(refusal.times++, kMaxDoublings);
  refusal.until_search = searches_ + (kRefusedSearches << doublings);
}

Vec3 Routes::PositionOf(const Reached& reached) const {
  return reached.place < 0 ? at_.position_W_m : free_.PositionOf(reached.place);
}

void Routes::Search(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at) {
  at_ = at;
  ++searches_;
  free_.Update(map, checker);
  has_refusals_.resize(static_cast<std::size_t>(free_.places()), false);
  ConnectVehicle(map, checker);
  FindReached();
}

void Routes::FindReached() {
  reached_.resize(1);
  struct Open {
    double time_s;
    int number;  // Of opened; breaks ties.
    bool operator>(const Open& other) const {
      return std::tie(time_s, number) > std::tie(other.time_s, other.number);
    }
  };
  std::vector<Reached> opened = starts_;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> queue;
  for (std::size_t i = 0; i < opened.size(); ++i)
    if (!IsRefused(-1, opened[i].place)) queue.push({opened[i].time_s, static_cast<int>(i)});
  // Headings of each place that were reached already, and the arc that was opened there last.
  std::vector<HeadingSet> done(static_cast<std::size_t>(free_.places()), 0);
  struct Arc {
    HeadingSet arc = 0;
    double time_s = 0;
  };
  std::vector<Arc> newest(done.size());
  std::vector<int> neighbours;
  while (!queue.empty()) {
    const Reached here = opened[static_cast<std::size_t>(queue.top().number)];
    queue.pop();
    HeadingSet& done_here = done[static_cast<std::size_t>(here.place)];
    if ((done_here & here.arc) != 0) continue;
    done_here |= here.arc;
    const int index = static_cast<int>(reached_.size());
    reached_.push_back(here);
    const Vec3 p_W = free_.PositionOf(here.place);
    free_.NeighboursOf(here.place, neighbours);
    for (const int next : neighbours) {
      const HeadingSet set = free_.HeadingsAt(next);
      HeadingSet left = set & here.arc & ~done[static_cast<std::size_t>(next)];
      if (left == 0 || IsRefused(here.place, next)) continue;
      const double time_s =
          here.time_s + (free_.PositionOf(next) - p_W).norm() / limits_.max_speed_m_s;
      while (left != 0) {
        const HeadingSet arc = ArcAround(set, std::countr_zero(left));
        left &= ~arc;
        Arc& known = newest[static_cast<std::size_t>(next)];
        if (known.arc == arc && known.time_s <= time_s) continue;  // It would come too late.
        known = {arc, time_s};
        queue.push({time_s, static_cast<int>(opened.size())});
        opened.push_back({next, arc, time_s, index});
      }
    }
  }
}

void Routes::ConnectVehicle(const OccupancyMap& map, const CollisionChecker& checker) {
  const int heading = HeadingOfYaw(at_.yaw_rad);
  HeadingSet set = 1u << heading;  // Where it is, it is.
  for (int h = 0; h < kHeadings; ++h)
    if (checker.IsFree(map, {at_.position_W_m, YawOfHeading(h)})) set |= 1u << h;
  const HeadingSet arc = ArcAround(set, heading);
  reached_ = {{-1, arc, 0, -1}};
  starts_.clear();
  for (const int place : free_.PlacesAround(at_.position_W_m, kStartSteps * free_.spacing_m())) {
    const HeadingSet there = free_.HeadingsAt(place);
    if ((there & arc) == 0) continue;
    const Waypoint to{free_.PositionOf(place),
                      YawOfHeading(NearestHeading(there & arc, at_.yaw_rad))};
    const double length_m = LengthOf(at_, to);
    if (length_m > kStartSteps * free_.spacing_m() || !checker.IsEdgeFree(map, at_, to)) continue;
    starts_.push_back(
        {place, ArcAround(there, HeadingOfYaw(to.yaw_rad)), length_m / limits_.max_speed_m_s, 0});
  }
}

std::vector<int> Routes::ChainTo(int index) const {
  std::vector<int> chain;
  for (int i = index; i >= 0; i = reached_[static_cast<std::size_t>(i)].from) chain.push_back(i);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

/// Turns evenly along the way, as far as each place has room for it.
std::vector<Waypoint> Routes::WaypointsOf(const std::vector<int>& chain, double yaw_rad) const {
  std::vector<double> along_m = {0};
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const Vec3 step = PositionOf(reached_[static_cast<std::size_t>(chain[i])]) -
                      PositionOf(reached_[static_cast<std::size_t>(chain[i - 1])]);
    along_m.push_back(along_m.back() + step.norm());
  }
  const double turn_rad = WrapAngle(yaw_rad - at_.yaw_rad);
  std::vector<Waypoint> waypoints = {at_};
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const Reached& reached = reached_[static_cast<std::size_t>(chain[i])];
    const double share = along_m.back() > 0 ? along_m[i] / along_m.back() : 1;
    const double yaw = WrapAngle(at_.yaw_rad + share * turn_rad);
    const bool is_roomy = reached.arc == kAllHeadings;
    waypoints.push_back(
        {PositionOf(reached), is_roomy ? yaw : YawOfHeading(NearestHeading(reached.arc, yaw))});
  }
  const Waypoint goal{waypoints.back().position_W_m, yaw_rad};
  if (chain.size() == 1 || std::abs(WrapAngle(goal.yaw_rad - waypoints.back().yaw_rad)) > 1e-9)
    waypoints.push_back(goal);
  return waypoints;
}

std::optional<std::vector<Waypoint>> Routes::RouteTo(const OccupancyMap& map,
                                                     const CollisionChecker& checker, int index,
                                                     double yaw_rad) {
  const std::vector<int> chain = ChainTo(index);
  const std::vector<Waypoint> way = WaypointsOf(chain, yaw_rad);
  std::vector<Waypoint> flown = {way.front()};
  for (std::size_t i = 0; i + 1 < way.size();) {
    // As far ahead as the straight line can be flown.
    std::optional<std::vector<Waypoint>> step;
    std::size_t ahead = way.size() - 1 - i;
    for (; ahead > 0; ahead /= 2) {
      step = FlownStep(map, checker, flown.back(), way[i], way[i + ahead]);
      if (step) break;
    }
    if (!step) {
      const auto place_of = [&](std::size_t n) {
        return reached_[static_cast<std::size_t>(chain[std::min(n, chain.size() - 1)])].place;
      };
      Refuse(place_of(i), place_of(i + 1));
      FindReached();
      return std::nullopt;
    }
    i += ahead;
    for (const Waypoint& waypoint : *step) Append(waypoint, flown);
  }
  Append(way.back(), flown);
  return flown;
}

void Routes::RefuseTurnAt(int index) {
  const int place = reached_[static_cast<std::size_t>(index)].place;
  Refuse(place, place);
  FindReached();
}

std::optional<int> Routes::ReachedNear(const Vec3& p_W, double radius_m,
                                       HeadingSet headings) const {
  std::optional<int> nearest;
  double least_m = radius_m;
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    const double away_m = (PositionOf(reached_[i]) - p_W).norm();
    if (away_m >= least_m || (reached_[i].arc & headings) == 0) continue;
    least_m = away_m;
    nearest = static_cast<int>(i);
  }
  return nearest;
}

}  // namespace vog
