#pragma once

#include <optional>

#include "lib/base/config.h"
#include "lib/geometry/odometry.h"
#include "lib/navigation/instrument_filter.h"
#include "lib/navigation/records.h"

namespace vog {

struct DeadReckoningOptions {
  InstrumentErrors errors;
  double bias_horizon_s = 60;
  double dvl_period_s = 0.2;
  double no_lock_sigma_m_s = 0.15;
  double lock_lost_after_s = 1.0;
  double depth_gain = 0.2;
  double max_acceleration_m_s2 = 0.5;
  double gate_sigmas = 6;
  int believed_outliers = 5;

  void Visit(OptionsVisitor& v) {
    errors.Visit(v);
    v("bias_horizon_s", bias_horizon_s, Between(1, 1e6),
      "biases that nothing observes are taken to add up for so long");
    v("dvl_period_s", dvl_period_s, Between(0.01, 60), "between two velocities");
    v("no_lock_sigma_m_s", no_lock_sigma_m_s, Between(1e-3, 10),
      "of the velocity that is assumed without bottom lock");
    v("lock_lost_after_s", lock_lost_after_s, Between(0.05, 600),
      "a velocity this old is no longer trusted");
    v("depth_gain", depth_gain, Between(0.01, 1),
      "share of a depth that nothing explains which corrects the height");
    v("max_acceleration_m_s2", max_acceleration_m_s2, Between(0.01, 100),
      "of the vehicle: a velocity that would need more is an outlier");
    v("gate_sigmas", gate_sigmas, Between(1, 100), "and this many dvl_sigma_m_s beyond it");
    v("believed_outliers", believed_outliers, Between(2, 1000),
      "so many outliers in a row that agree with each other are the truth");
  }
};

/// Tells the velocities of a Doppler log that no vehicle flies from the others: echoes of fish, of
/// the structure, of other vehicles. The last one that was taken is the yardstick; after a while of
/// outliers that agree with each other, they were right and it was not.
class VelocityGate {
 public:
  explicit VelocityGate(const DeadReckoningOptions& options) : options_(options) {}

  /// Whether to take a valid record.
  bool Passes(const DvlRecord& record);

  std::int64_t outliers() const { return outliers_; }

 private:
  bool Agree(const DvlRecord& a, const DvlRecord& b) const;

  DeadReckoningOptions options_;
  std::optional<DvlRecord> taken_, outlier_;  ///< The last of each.
  int in_a_row_ = 0;                          ///< Outliers that agree.
  std::int64_t outliers_ = 0;
};

/// How far [m, rad] a reckoned pose may lie from where the vehicle's own velocity and turn rate
/// take the one before, and by how much more each second: more is no motion but a jump.
struct JumpLimits {
  double distance_m = 0.5, speed_m_s = 0.3;
  double turn_rad = 0.2, turn_rate_rad_s = 0.2;
};

/// Odometry from the pose that the vehicle's own computer reckons: adds the covariance that eq. 8's
/// drift has gathered since the start, a step of `scan_period_s` at a time. When the vehicle's
/// computer starts its reckoning anew, or its pose jumps, so does this, in a segment and with an
/// origin of its own: what was reckoned across a jump is not a motion.
class VehicleNavTracker {
 public:
  VehicleNavTracker(const DriftOptions& drift, double scan_period_s, std::int64_t segment,
                    const JumpLimits& limits = {});

  /// @pre records come in order of time.
  OdometrySample Add(const VehicleNavRecord& record);

  std::int64_t jumps() const { return jumps_; }

 private:
  bool IsJump(const VehicleNavRecord& record) const;
  void BeginAnew(std::int64_t origin);

  DriftOptions drift_;
  double scan_period_s_;
  std::int64_t segment_;
  JumpLimits limits_;
  std::optional<OdometrySample> last_;
  std::int64_t vehicle_origin_ = 0;  ///< That the vehicle's computer says,
  std::int64_t origin_ = 0;          ///< and what is passed on: after a jump, its time [us].
  std::int64_t jumps_ = 0;
};

/// Odometry from the instruments: what InstrumentFilter makes of gyro, attitude, DVL and depth,
/// integrated over time by the trapezoidal rule. Without bottom lock the last velocity holds for a
/// while, then none; the covariance grows faster meanwhile. Starts at the origin of O unless it is
/// told a fix.
///
/// The errors of one bias at different times are the same error; an OdometrySample's covariance,
/// from which those of motions are made by difference, can tell independent ones alone. So a bias
/// of variance s^2 counts as noise of density 2 s^2 min(t, h) at time t since the start, h =
/// `bias_horizon_s`. Until h the heading's variance is s^2 t^2 as it really is. By Cauchy and
/// Schwarz the sum over a motion of duration T that begins after h has at most T / (2 h) times the
/// variance that it is said to have: an upper bound for whatever is shorter than two horizons.
class DeadReckoner {
 public:
  DeadReckoner(const DeadReckoningOptions& options, std::int64_t segment);

  /// Position and heading from elsewhere. Taken only before the first sample.
  void SetFix(const Pose3& X_OB);
  void Add(const DvlRecord& record);
  void Add(const DepthRecord& record);
  /// Moves on to the record's time. Nothing before the first depth, and for the record that starts
  /// it.
  std::optional<OdometrySample> Add(const ImuRecord& record);

  /// Whether the last velocity over the bottom is not too old at `time`.
  bool HasLock(Time time) const;
  /// Velocities that were not believed.
  std::int64_t outliers() const { return gate_.outliers(); }
  const InstrumentFilter& filter() const { return filter_; }

 private:
  void Start(const ImuRecord& record);
  void Measure(const ImuRecord& record);
  Eigen::Matrix2d PositionNoise(double correlated_s) const;
  Mat3 AddedCovariance(double dt_s) const;

  DeadReckoningOptions options_;
  InstrumentFilter filter_;
  OdometrySample state_;
  bool is_started_ = false;
  double reckoned_s_ = 0;              // Since the start.
  Vec3 rates_B_rad_s_ = Vec3::Zero();  // The last that the gyro said.
  VelocityGate gate_;
  std::optional<DvlRecord> velocity_;          // The last one that was taken,
  std::optional<Vec3> unused_velocity_B_m_s_;  // and if the filter has not got it.
  std::optional<double> unused_z_m_;           // The last height likewise.
};

}  // namespace vog
