#pragma once

#include <deque>

#include "lib/base/config.h"
#include "lib/base/time.h"
#include "sim/vehicle/vehicle.h"

namespace vog {

/// Table [navigation_faults]: errors of the navigation that no drift model knows of.
struct NavigationFaultOptions {
  double speed_scale = 0;
  double misalignment_deg = 0;
  double delay_s = 0;
  double jump_m = 0;
  double jump_at_s = 600;
  double lock_lost_s = 0;
  double lock_lost_at_s = 600;

  void Visit(OptionsVisitor& v) {
    v("speed_scale", speed_scale, Between(-0.5, 0.5),
      "share by which the Doppler log tells horizontal velocities too large");
    v("misalignment_deg", misalignment_deg, Between(-45, 45),
      "how far the Doppler log is turned to the left of the heading");
    v("delay_s", delay_s, Between(0, 5), "how old all records are when they are stamped");
    v("jump_m", jump_m, Between(0, 1000),
      "the vehicle's reckoning jumps so far along x, once and without notice");
    v("jump_at_s", jump_at_s, Between(0, 1e6), "when it does");
    v("lock_lost_s", lock_lost_s, Between(0, 1e6),
      "for how long the Doppler log loses the bottom, once");
    v("lock_lost_at_s", lock_lost_at_s, Between(0, 1e6), "when it does");
  }

  /// Whether poses and motions are told wrong.
  bool IsAny() const {
    return speed_scale != 0 || misalignment_deg != 0 || delay_s != 0 || jump_m != 0;
  }
};

/// What faulty instruments take for the truth.
class NavigationFaults {
 public:
  explicit NavigationFaults(const NavigationFaultOptions& options) : options_(options) {}

  /// The state that is told at `time`: the planar motions so far scaled and turned, then delayed,
  /// then moved by the jump; z, roll, pitch and turn rates are only delayed. Between calls the
  /// vehicle is taken to move evenly. Without faults it is `truth` to the last bit. @pre times do
  /// not decrease.
  VehicleState Apply(Time time, const VehicleState& truth);

  /// Whether the Doppler log is without the bottom at `time`.
  bool HasLostLock(Time time) const;

 private:
  struct Moment {
    Time time;
    VehicleState state;
  };

  Vec3 Told(const Vec3& motion_B) const;
  VehicleState At(Time time) const;

  NavigationFaultOptions options_;
  Pose3 last_true_ = Pose3::Identity(), last_told_ = Pose3::Identity();  ///< Level.
  std::deque<Moment> told_;  ///< As old as the delay, undelayed and without the jump.
};

}  // namespace vog
