#pragma once

#include <cmath>
#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// Where a hovering vehicle can be told to be: level, at a place, with a heading.
struct Waypoint {
  Vec3 position_W_m = Vec3::Zero();
  double yaw_rad = 0;

  Pose3 X_WB() const { return MakePose(position_W_m, {0, 0, yaw_rad}); }
};

inline Waypoint WaypointOf(const Pose3& X_WB) { return {X_WB.translation(), YawOf(X_WB)}; }

/// On the straight line and the shorter turn between two waypoints; fraction 0..1.
inline Waypoint Interpolate(const Waypoint& a, const Waypoint& b, double fraction) {
  return {a.position_W_m + fraction * (b.position_W_m - a.position_W_m),
          WrapAngle(a.yaw_rad + fraction * WrapAngle(b.yaw_rad - a.yaw_rad))};
}

inline double LengthOf(const Waypoint& a, const Waypoint& b) {
  return (b.position_W_m - a.position_W_m).norm();
}

/// But for rounding.
inline bool IsSame(const Waypoint& a, const Waypoint& b) {
  return LengthOf(a, b) < 1e-9 && std::abs(WrapAngle(a.yaw_rad - b.yaw_rad)) < 1e-9;
}

/// Adds a waypoint to a path unless it ends there. @pre the path is not empty.
inline void Append(const Waypoint& to, std::vector<Waypoint>& path) {
  if (!IsSame(path.back(), to)) path.push_back(to);
}

/// What lies within `length_m` of a way's beginning. @pre the way is not empty.
inline std::vector<Waypoint> FirstPartOf(const std::vector<Waypoint>& way, double length_m) {
  std::vector<Waypoint> part = {way.front()};
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double edge_m = LengthOf(way[i - 1], way[i]);
    if (edge_m > length_m) {
      part.push_back(Interpolate(way[i - 1], way[i], length_m / edge_m));
      break;
    }
    part.push_back(way[i]);
    length_m -= edge_m;
  }
  return part;
}

}  // namespace vog
