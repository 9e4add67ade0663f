#include "lib/submap/submap_builder.h"

#include <cmath>
#include <utility>

namespace vog {
namespace {

/// Puts a covariance of (x, y, yaw) into one of all six, the other three as measured at both ends.
Mat6 WithAbsolutes(const Mat3& planar, const DriftOptions& drift) {
  constexpr int kIndex[3] = {0, 1, 5};
  Mat6 covariance = Mat6::Zero();
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) covariance(kIndex[row], kIndex[col]) = planar(row, col);
  const double angle = drift.sigma_roll_pitch_rad * drift.sigma_roll_pitch_rad;
  covariance(2, 2) += 2 * drift.sigma_z_m * drift.sigma_z_m;
  covariance(3, 3) += 2 * angle;
  covariance(4, 4) += 2 * angle;
  return covariance;
}

/// The motion from the last sample before a gap, N, to the first after it, T; covariance of (x, y,
/// yaw).
struct Gap {
  Pose3 X_NT;
  Mat3 covariance;
};

/// Yaw, x and y of the new segment start anywhere; z, roll and pitch are still true.
Gap BlindGap(const SubmapOptions& options, const OdometrySample& newest, const OdometrySample& to) {
  const double gap_s = std::abs(ToSeconds(to.time - newest.time));
  const double moved = std::pow(options.gap_speed_m_s * gap_s, 2) + 1e-4;
  const double turned = std::pow(options.gap_yaw_rate_rad_s * gap_s, 2) + 1e-6;
  return {MakePose({0, 0, to.X_OB.translation().z() - newest.X_OB.translation().z()}),
          Vec3(moved, moved, turned).asDiagonal()};
}

/// The reckoning went on meanwhile, only its covariance was lost: it is taken to have grown as it
/// did since `from`.
Gap ReckonedGap(const OdometrySample& from, const OdometrySample& newest,
                const OdometrySample& to) {
  const double kept_s = ToSeconds(newest.time - from.time);
  const double gap_s = ToSeconds(to.time - newest.time);
  const Mat3 kept = MotionCovariance(from, newest);
  return {Ominus(newest.X_OB, to.X_OB), kept_s > 0 ? Mat3(gap_s / kept_s * kept) : kept};
}

}  // namespace

OdometryEdge MakeOdometryEdge(const SubmapOptions& options, const DriftOptions& drift,
                              const OdometrySample& from, const OdometrySample& newest,
                              const OdometrySample& to) {
  if (from.segment == to.segment)
    return {Ominus(from.X_OB, to.X_OB), WithAbsolutes(MotionCovariance(from, to), drift)};
  const Gap gap =
      from.origin == to.origin ? ReckonedGap(from, newest, to) : BlindGap(options, newest, to);
  const Mat3 planar =
      ComposePlanarCovariance(MotionCovariance(from, newest), gap.X_NT, gap.covariance);
  return {Ominus(from.X_OB, newest.X_OB) * gap.X_NT, WithAbsolutes(planar, drift)};
}

OdometrySample OdometryAtLastScan(const Submap& submap) {
  const OdometrySample& base = submap.base.odometry;
  OdometrySample last = base;
  last.time = submap.last_scan;
  last.X_OB = base.X_OB * submap.X_ML;
  last.covariance = ComposePlanarCovariance(base.covariance, submap.X_ML, submap.drift);
  return last;
}

SubmapBuilder::SubmapBuilder(const SubmapOptions& options, const SensorModelOptions& model,
                             const DriftOptions& drift)
    : options_(options), model_(model), drift_(drift) {}

SubmapPtr SubmapBuilder::Add(const RegisteredScan& registered) {
  SubmapPtr closed;
  if (open_ && !GoesOnWith(registered.odometry)) closed = Close();
  if (!open_) Open(registered);
  const OdometrySample& base = open_->base.odometry;
  X_MB_ = Ominus(base.X_OB, registered.odometry.X_OB);
  inserter_->Insert(registered.scan, X_MB_, open_->grid);
  open_->last_scan = registered.scan.time;
  open_->X_ML = X_MB_;
  open_->drift = MotionCovariance(base, registered.odometry);
  ++open_->scans;
  newest_ = registered.odometry;
  if (!closed && open_->scans >= options_.scans_per_submap) closed = Close();
  return closed;
}

SubmapPtr SubmapBuilder::Close() {
  if (!open_) return nullptr;
  previous_ = Tail{.id = open_->id(), .base = open_->base.odometry, .newest = newest_};
  inserter_.reset();
  open_->grid.Compact();
  return std::exchange(open_, nullptr);
}

void SubmapBuilder::Drop() {
  inserter_.reset();
  open_.reset();
}

void SubmapBuilder::ContinueAfter(const Submap& last) {
  previous_ = Tail{.id = last.id(), .base = last.base.odometry, .newest = OdometryAtLastScan(last)};
}

void SubmapBuilder::BeginFlight(const Submap& last, const PlaceInMap& place) {
  ContinueAfter(last);
  put_in_ = PutIn{place, (last.base.odometry.X_OB * place.X_ME).translation().z()};
}

void SubmapBuilder::ContinueFlight(const SubmapBase& first) {
  previous_ = Tail{first.id - 1, first.odometry, first.odometry, first.edge};
}

void SubmapBuilder::Open(const RegisteredScan& registered) {
  open_ = std::make_shared<Submap>(Submap{.base = {},
                                          .first_scan = registered.scan.time,
                                          .last_scan = registered.scan.time,
                                          .grid = BrickGrid(options_.voxel_size_m)});
  open_->base.odometry = registered.odometry;
  if (previous_) {
    open_->base.id = previous_->id + 1;
    open_->base.edge = EdgeTo(registered.odometry);
    // From here on odometry tells where the vehicle is in the map.
    if (std::exchange(put_in_, std::nullopt)) ContinueFlight(open_->base);
  }
  inserter_.emplace(SensorModel(model_), options_.voxel_size_m);
}

OdometryEdge SubmapBuilder::EdgeTo(const OdometrySample& to) const {
  if (put_in_) {
    const double risen_m = to.X_OB.translation().z() - put_in_->z_W_m;
    return {put_in_->place.X_ME * MakePose({0, 0, risen_m}),
            WithAbsolutes(put_in_->place.covariance, drift_)};
  }
  const auto& [id, base, newest, X_PB] = *previous_;
  const OdometryEdge edge = MakeOdometryEdge(options_, drift_, base, newest, to);
  return {X_PB.X_PM * edge.X_PM,
          WithAbsolutes(ComposePlanarCovariance(PlanarOf(X_PB.covariance), edge.X_PM,
                                                PlanarOf(edge.covariance)),
                        drift_)};
}

bool SubmapBuilder::GoesOnWith(const OdometrySample& odometry) const {
  const OdometrySample& base = open_->base.odometry;
  if (odometry.segment != base.segment) return false;
  const Mat3 P = MotionCovariance(base, odometry);
  return std::sqrt(std::max(P(0, 0), P(1, 1))) <= options_.max_sigma_xy_m &&
         std::sqrt(P(2, 2)) <= options_.max_sigma_yaw_rad;
}

}  // namespace vog
