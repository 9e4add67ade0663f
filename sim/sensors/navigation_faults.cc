#include "sim/sensors/navigation_faults.h"

#include <cmath>

#include "lib/scan/sonar.h"

namespace vog {

Vec3 NavigationFaults::Told(const Vec3& motion_B) const {
  const double scale = 1 + options_.speed_scale, turn = ToRadians(options_.misalignment_deg);
  const double c = scale * std::cos(turn), s = scale * std::sin(turn);
  return {c * motion_B.x() - s * motion_B.y(), s * motion_B.x() + c * motion_B.y(), motion_B.z()};
}

VehicleState NavigationFaults::At(Time time) const {
  auto after = told_.begin();
  while (after != told_.end() && after->time < time) ++after;
  if (after == told_.begin()) return after->state;
  const Moment& before = *(after - 1);
  const double fraction = ToSeconds(time - before.time) / ToSeconds(after->time - before.time);
  const VehicleState &a = before.state, &b = after->state;
  return {Interpolate(a.X_WB, b.X_WB, fraction),
          a.velocity_B_m_s + fraction * (b.velocity_B_m_s - a.velocity_B_m_s),
          a.angular_velocity_B_rad_s +
              fraction * (b.angular_velocity_B_rad_s - a.angular_velocity_B_rad_s)};
}

bool NavigationFaults::HasLostLock(Time time) const {
  const Time begin(FromSeconds(options_.lock_lost_at_s));
  return time >= begin && time - begin < FromSeconds(options_.lock_lost_s);
}

VehicleState NavigationFaults::Apply(Time time, const VehicleState& truth) {
  if (!options_.IsAny()) return truth;
  const Pose3 true_pose = Level(truth.X_WB);
  if (told_.empty()) last_true_ = last_told_ = true_pose;
  Pose3 motion = Ominus(last_true_, true_pose);
  motion.translation() = Told(motion.translation());
  last_true_ = true_pose;
  last_told_ = last_told_ * motion;

  VehicleState state = truth;
  const RollPitchYaw angles = AnglesOf(truth.X_WB);
  state.X_WB = MakePose(
      {last_told_.translation().x(), last_told_.translation().y(), truth.X_WB.translation().z()},
      {angles.roll, angles.pitch, YawOf(last_told_)});
  state.velocity_B_m_s = Told(truth.velocity_B_m_s);
  if (told_.empty() || told_.back().time < time) told_.push_back({time, state});
  const Time stamped = time - FromSeconds(options_.delay_s);
  while (told_.size() > 2 && told_[1].time <= stamped) told_.pop_front();
  state = At(stamped);
  if (options_.jump_m > 0 && time >= Time(FromSeconds(options_.jump_at_s)))
    state.X_WB.translation().x() += options_.jump_m;
  return state;
}

}  // namespace vog
