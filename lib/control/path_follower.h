#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lib/base/config.h"
#include "lib/geometry/waypoint.h"
#include "lib/navigation/records.h"

namespace vog {

struct ControllerOptions {
  double max_speed_m_s = 0.25;
  double max_yaw_rate_rad_s = 0.15;
  double position_gain_1_s = 0.5;
  double yaw_gain_1_s = 0.6;
  double max_lag_m = 0.25;
  double max_lag_rad = 0.3;

  void Visit(OptionsVisitor& v) {
    v("max_speed_m_s", max_speed_m_s, Between(0.01, 5), "largest commanded speed");
    v("max_yaw_rate_rad_s", max_yaw_rate_rad_s, Between(0.01, 3), "largest commanded yaw rate");
    v("position_gain_1_s", position_gain_1_s, Between(0.01, 10), "speed per metre of error");
    v("yaw_gain_1_s", yaw_gain_1_s, Between(0.01, 10), "yaw rate per radian of error");
    v("max_lag_m", max_lag_m, Between(0.01, 5), "the target waits for a vehicle this far behind");
    v("max_lag_rad", max_lag_rad, Between(0.01, 3), "or turned this far away from it");
  }
};

/// Follows a path of waypoints: a target moves along it, position and heading together, at the
/// greatest speed within both limits, and waits when the vehicle falls behind; the vehicle is
/// steered to the target. Keeps to the straight lines, because only those were found free.
class PathFollower {
 public:
  explicit PathFollower(const ControllerOptions& options) : options_(options) {}

  /// Starts on a new path; its first waypoint should be near the vehicle. An empty one means: stay.
  void Follow(std::vector<Waypoint> path);

  /// Moves the target on by `dt_s` and gives the velocities for the body at `X_WB`. Never above the
  /// limits. Without a path: stop.
  VelocityCommand Step(const Pose3& X_WB, double dt_s);

  /// The path's end; nothing without a path.
  std::optional<Waypoint> goal() const;
  bool TargetAtEnd() const { return IsAtEnd(target_); }

 private:
  /// A place on the path: this share of the way from path_[leg] to path_[leg + 1].
  struct Cursor {
    std::size_t leg = 0;
    double fraction = 0;
  };

  bool IsAtEnd(const Cursor& cursor) const { return cursor.leg + 1 >= path_.size(); }
  Cursor Advanced(Cursor cursor, double dt_s) const;
  Waypoint At(const Cursor& cursor) const;

  ControllerOptions options_;
  std::vector<Waypoint> path_;
  Cursor target_;
};

}  // namespace vog
