#pragma once

#include <optional>
#include <vector>

#include "lib/collision/collision_checker.h"
#include "lib/geometry/waypoint.h"
#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// How a vehicle at `at` flies a step of a path, which begins there, perhaps with another heading:
/// the waypoints after `at`, all edges free. Through water that is not surely known it flies with
/// the sonar turned to where it goes, so that what older submaps show elsewhere is seen before it
/// is met, and only where there is room to turn so at both ends. Steps that hardly go sideways are
/// flown as planned. Nothing where the step cannot be flown.
std::optional<std::vector<Waypoint>> FlownStep(const OccupancyMap& map,
                                               const CollisionChecker& checker, const Waypoint& at,
                                               const Waypoint& from, const Waypoint& to);

/// What becomes of a step that cannot be flown.
enum class Refused { kEndsThePath, kIsFlownAsPlanned };

/// A path in such steps. @pre the path is not empty.
std::vector<Waypoint> FlownPath(const OccupancyMap& map, const CollisionChecker& checker,
                                const std::vector<Waypoint>& path, Refused refused);

/// Whether a way of this length and direction is one of those that the sonar must be turned to.
bool GoesSideways(const Vec3& step_m);
/// The heading that turns the sonar to where such a way goes.
double YawAlong(const Vec3& step_m);

}  // namespace vog
