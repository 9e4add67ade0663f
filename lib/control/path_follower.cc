#include "lib/control/path_follower.h"

#include <algorithm>
#include <cmath>

namespace vog {

void PathFollower::Follow(std::vector<Waypoint> path) {
  path_ = std::move(path);
  target_ = {};
}

std::optional<Waypoint> PathFollower::goal() const {
  if (path_.empty()) return std::nullopt;
  return path_.back();
}

Waypoint PathFollower::At(const Cursor& cursor) const {
  if (IsAtEnd(cursor)) return path_.back();
  return Interpolate(path_[cursor.leg], path_[cursor.leg + 1], cursor.fraction);
}

PathFollower::Cursor PathFollower::Advanced(Cursor cursor, double dt_s) const {
  while (dt_s > 0 && !IsAtEnd(cursor)) {
    const Waypoint& from = path_[cursor.leg];
    const Waypoint& to = path_[cursor.leg + 1];
    const double leg_s = std::max(
        {LengthOf(from, to) / options_.max_speed_m_s,
         std::abs(WrapAngle(to.yaw_rad - from.yaw_rad)) / options_.max_yaw_rate_rad_s, 1e-6});
    const double left_s = (1 - cursor.fraction) * leg_s;
    if (dt_s < left_s) return {cursor.leg, cursor.fraction + dt_s / leg_s};
    dt_s -= left_s;
    cursor = {cursor.leg + 1, 0};
  }
  return cursor;
}

VelocityCommand PathFollower::Step(const Pose3& X_WB, double dt_s) {
  if (path_.empty()) return {};
  const auto is_close = [&](const Waypoint& at) {
    return (at.position_W_m - X_WB.translation()).norm() < options_.max_lag_m &&
           std::abs(WrapAngle(at.yaw_rad - YawOf(X_WB))) < options_.max_lag_rad;
  };
  const bool moves = is_close(At(target_));
  if (moves) target_ = Advanced(target_, dt_s);

  // The target's own velocity leads, so that the vehicle does not trail behind by speed / gain. A
  // target that waits has none: the vehicle would come to rest ahead of it, both for ever.
  const Waypoint target = At(target_);
  const Waypoint ahead = moves ? At(Advanced(target_, dt_s)) : target;
  const double per_s = dt_s > 0 ? 1 / dt_s : 0;
  Vec3 velocity_W = per_s * (ahead.position_W_m - target.position_W_m) +
                    options_.position_gain_1_s * (target.position_W_m - X_WB.translation());
  velocity_W *= std::min(1.0, options_.max_speed_m_s / std::max(velocity_W.norm(), 1e-9));
  const double yaw_rate_rad_s = per_s * WrapAngle(ahead.yaw_rad - target.yaw_rad) +
                                options_.yaw_gain_1_s * WrapAngle(target.yaw_rad - YawOf(X_WB));
  return {X_WB.linear().transpose() * velocity_W,
          std::clamp(yaw_rate_rad_s, -options_.max_yaw_rate_rad_s, options_.max_yaw_rate_rad_s)};
}

}  // namespace vog
