#pragma once

#include <cstdint>
#include <optional>

#include "lib/geometry/odometry.h"
#include "lib/navigation/records.h"
#include "sim/vehicle/vehicle.h"

namespace vog {

/// A vehicle computer whose dead reckoning drifts as eq. 8 of Ho et al. 2018 says. A step is a
/// sonar scan: the true motion of a step, in (x, y, yaw), is followed by noise on the body side,
///
///   P^_k+1 = P^_k (+) ((P_k+1 (-) P_k) (+) s * N(0, Sigma)),   s = dt or sqrt(dt),
///
/// and z, roll and pitch are the truth plus noise of the step. Between the steps both noises go
/// over linearly, so that asking more often changes nothing. Step k draws from Random(seed,
/// "drift", k).
class DriftedNavigation {
 public:
  /// `start_error` is by how much the first pose is off in (x, y, yaw), in W.
  DriftedNavigation(const DriftOptions& options, Duration scan_period, std::uint64_t seed,
                    const Vec3& start_error = Vec3::Zero());

  /// What the computer says at `time`. The first call is step 0, and but for `start_error` the
  /// truth in x, y and yaw; the steps follow every `scan_period`. Where no call falls on a step,
  /// the truth is taken to move evenly between the calls. The velocity is that of the drifting
  /// pose.
  /// @pre times increase.
  VehicleNavRecord Sample(Time time, std::int64_t sequence, const VehicleState& truth);

 private:
  /// The noise of a step: of its motion in (x, y, yaw), and of its (z, roll, pitch).
  struct Noise {
    Vec3 motion = Vec3::Zero(), absolute = Vec3::Zero();
  };
  /// Poses of a level vehicle, (x, y, yaw) only.
  struct Step {
    Time time;
    std::int64_t number = 0;
    Pose3 true_pose, drifted_pose;
    Noise here, next;  // Of this step and of the one after it.
  };

  Noise NoiseOf(std::int64_t step) const;
  Step FirstStep(Time time, const Pose3& X_WB) const;
  Step NextStep(const Pose3& X_WB) const;
  Pose3 Drifted(const Pose3& X_WB, double fraction) const;

  DriftOptions options_;
  Duration scan_period_;
  std::uint64_t seed_;
  Vec3 start_error_;
  Vec3 motion_sigma_;
  std::optional<Step> step_;  // The last one, from the first call on.
  Time last_time_;
  Pose3 last_X_WB_;
};

}  // namespace vog
