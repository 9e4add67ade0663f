#include "lib/planner/flown_step.h"

#include <cmath>

namespace vog {
namespace {

/// Of a step that the sonar is turned to.
constexpr double kNoseFirst_m = 0.3;

bool IsWayFree(const OccupancyMap& map, const CollisionChecker& checker,
               const std::vector<Waypoint>& way) {
  for (std::size_t i = 1; i < way.size(); ++i)
    if (!IsSame(way[i - 1], way[i]) && !checker.IsEdgeFree(map, way[i - 1], way[i])) return false;
  return true;
}

}  // namespace

std::optional<std::vector<Waypoint>> FlownStep(const OccupancyMap& map,
                                               const CollisionChecker& checker, const Waypoint& at,
                                               const Waypoint& from, const Waypoint& to) {
  const Vec3 step_m = to.position_W_m - from.position_W_m;
  const bool is_short = !GoesSideways(step_m);
  const bool is_free = IsWayFree(map, checker, {at, from, to});
  if (is_free && (is_short || checker.IsSurelyKnown(map, from, to))) return std::vector{from, to};
  if (is_short || map.IsSure()) return std::nullopt;
  const double ahead_rad = YawAlong(step_m);
  const Waypoint turned{from.position_W_m, ahead_rad}, there{to.position_W_m, ahead_rad};
  if (!IsWayFree(map, checker, {at, turned, there, to})) return std::nullopt;
  return std::vector{turned, there};
}

std::vector<Waypoint> FlownPath(const OccupancyMap& map, const CollisionChecker& checker,
                                const std::vector<Waypoint>& path, Refused refused) {
  std::vector<Waypoint> flown = {path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Waypoint &from = path[i - 1], &to = path[i];
    const auto step = FlownStep(map, checker, flown.back(), from, to);
    if (!step && refused == Refused::kEndsThePath) return flown;
    for (const Waypoint& waypoint : step.value_or(std::vector{from, to})) Append(waypoint, flown);
  }
  Append(path.back(), flown);
  return flown;
}

bool GoesSideways(const Vec3& step_m) { return step_m.head<2>().norm() >= kNoseFirst_m; }

double YawAlong(const Vec3& step_m) { return std::atan2(step_m.y(), step_m.x()); }

}  // namespace vog
