#pragma once

#include <memory>
#include <optional>

#include "lib/base/config.h"
#include "lib/scan/scan.h"
#include "lib/submap/put_in.h"
#include "lib/submap/scan_inserter.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// Section III-B: when a submap is full, and what joins it to the one before.
struct SubmapOptions {
  double voxel_size_m = 0.095;
  int scans_per_submap = 100;
  double max_sigma_xy_m = 0.5;
  double max_sigma_yaw_rad = 0.05;
  double gap_speed_m_s = 0.25;
  double gap_yaw_rate_rad_s = 0.15;

  void Visit(OptionsVisitor& v) {
    v("voxel_size_m", voxel_size_m, Between(0.005, 5), "side of a voxel");
    v("scans_per_submap", scans_per_submap, Between(1, 100000), "a submap is full with these");
    v("max_sigma_xy_m", max_sigma_xy_m, Between(0.001, 100),
      "or when the drift since its first scan passes this standard deviation");
    v("max_sigma_yaw_rad", max_sigma_yaw_rad, Between(1e-5, 3), "or this one");
    v("gap_speed_m_s", gap_speed_m_s, Between(0, 10),
      "how fast the vehicle may have moved while navigation was down");
    v("gap_yaw_rate_rad_s", gap_yaw_rate_rad_s, Between(0, 10), "and how fast it may have turned");
  }
};

/// Collects scans into submaps.
class SubmapBuilder {
 public:
  /// `drift` tells how well z, roll and pitch are measured.
  SubmapBuilder(const SubmapOptions& options, const SensorModelOptions& model,
                const DriftOptions& drift);

  /// Adds a scan. Returns the submap that this closed: the one before the scan when the scan begins
  /// a new navigation segment or the way to it is too uncertain, the one that the scan filled
  /// otherwise.
  SubmapPtr Add(const RegisteredScan& registered);

  /// Closes the open submap as it is; nothing when it has no scan.
  SubmapPtr Close();

  /// Forgets the open submap; the next one takes its number.
  void Drop();

  /// Goes on after submaps of an earlier run of the program: the next id is one after `last`'s.
  void ContinueAfter(const Submap& last);
  /// Begins a flight on the map of earlier ones, which ends in `last`: the next scan's place is
  /// `place`, and what odometry told before tells nothing of it. Depth, roll and pitch are
  /// measured.
  void BeginFlight(const Submap& last, const PlaceInMap& place);
  /// Goes on with a flight whose first submap began at `first` and was lost.
  void ContinueFlight(const SubmapBase& first);

  /// The motion from the base of the last closed submap. @pre there is one.
  OdometryEdge EdgeTo(const OdometrySample& to) const;
  /// Whether a submap was closed, in this flight or before.
  bool HasLast() const { return previous_.has_value(); }

  /// The open submap, from its first scan on.
  const Submap* open() const { return open_ ? open_.get() : nullptr; }
  /// Pose of the body in the open submap at the newest scan.
  const Pose3& X_MB() const { return X_MB_; }

 private:
  struct Tail {
    SubmapId id;
    OdometrySample base, newest;
    OdometryEdge X_PB = {Pose3::Identity(), Mat6::Zero()};  // From its base to that of `base`.
  };
  /// Where the next scan is taken, after `last` and in W's height.
  struct PutIn {
    PlaceInMap place;
    double z_W_m;
  };

  void Open(const RegisteredScan& registered);
  /// Whether a scan taken there belongs to the open submap.
  bool GoesOnWith(const OdometrySample& odometry) const;

  SubmapOptions options_;
  SensorModelOptions model_;
  DriftOptions drift_;
  std::shared_ptr<Submap> open_;
  std::optional<ScanInserter> inserter_;  // Of the open submap.
  Pose3 X_MB_ = Pose3::Identity();
  std::optional<Tail> previous_;  // The submap before the open one.
  std::optional<PutIn> put_in_;   // Until the next scan.
  OdometrySample newest_;
};

/// The odometry edge between the bases of two submaps: the motion that odometry tells. Where the
/// navigation had a gap after `newest` and another origin afterwards, that of standing still
/// meanwhile, widened by what the vehicle may have done.
OdometryEdge MakeOdometryEdge(const SubmapOptions& options, const DriftOptions& drift,
                              const OdometrySample& from, const OdometrySample& newest,
                              const OdometrySample& to);

OdometrySample OdometryAtLastScan(const Submap& submap);

}  // namespace vog
