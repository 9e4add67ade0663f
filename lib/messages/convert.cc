#include "lib/messages/convert.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "lib/base/files.h"
#include "lib/submap/octree_file.h"

namespace vog {
namespace {

void CopyTo(const Vec3& v, double (&numbers)[3]) { std::copy_n(v.data(), 3, numbers); }
Vec3 VectorFrom(const double (&numbers)[3]) { return Eigen::Map<const Vec3>(numbers); }

bool IsWindow(double min_range_m, double max_range_m) {
  return min_range_m >= 0 && max_range_m > min_range_m && max_range_m < 1e4;
}

// Of a submap's file; more is no submap's.
constexpr int kMaxOctreeBytes = 1 << 28;

template <class Numbers>
bool AllFinite(const Numbers& numbers) {
  return std::all_of(std::begin(numbers), std::end(numbers),
                     [](auto number) { return std::isfinite(number); });
}

/// Finite, symmetric, without a negative variance in any direction but for rounding, and with none
/// that no vehicle can have.
template <int N>
bool IsCovariance(const double (&numbers)[N * N]) {
  if (!AllFinite(numbers)) return false;
  const Eigen::Matrix<double, N, N> matrix = MatrixFrom<N>(numbers);
  constexpr double kLargest = 1e8, kRounding = 1e-14;  // (10 km)^2.
  const double scale = matrix.cwiseAbs().maxCoeff();
  if (scale > kLargest) return false;
  if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(matrix,
                                                                         Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().minCoeff() >= -kRounding * scale;
}

odometry_sample_t ToSampleMessage(const OdometrySample& sample) {
  odometry_sample_t message{};
  message.utime_us = ToUtime(sample.time);
  message.origin = sample.origin;
  message.segment = sample.segment;
  message.X_OB = ToMessage(sample.X_OB);
  CopyMatrix<3>(sample.covariance, message.covariance_xyyaw);
  return message;
}

std::optional<OdometrySample> FromSampleMessage(const odometry_sample_t& message) {
  const auto X_OB = FromMessage(message.X_OB);
  if (!X_OB || !IsCovariance<3>(message.covariance_xyyaw) || !IsUtime(message.utime_us))
    return std::nullopt;
  OdometrySample sample;
  sample.time = FromUtime(message.utime_us);
  sample.origin = message.origin;
  sample.segment = message.segment;
  sample.X_OB = *X_OB;
  sample.covariance = MatrixFrom<3>(message.covariance_xyyaw);
  return sample;
}

}  // namespace

pose_t ToMessage(const Pose3& X_AB) {
  pose_t message{};
  CopyTo(X_AB.translation(), message.position_m);
  const Eigen::Quaterniond q(X_AB.linear());
  message.quaternion_wxyz[0] = q.w();
  message.quaternion_wxyz[1] = q.x();
  message.quaternion_wxyz[2] = q.y();
  message.quaternion_wxyz[3] = q.z();
  return message;
}

std::optional<Pose3> FromMessage(const pose_t& message) {
  // Also in coordinates of the whole earth nothing is farther off.
  constexpr double kFarthest_m = 1e7;
  const double* q = message.quaternion_wxyz;
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const Vec3 position = VectorFrom(message.position_m);
  // Written so that NaN fails too.
  if (!(position.cwiseAbs().maxCoeff() <= kFarthest_m) || !position.allFinite() ||
      !(std::abs(rotation.norm() - 1) < 1e-6))
    return std::nullopt;
  return MakePose(position, rotation);
}

covariance_t ToMessage(const Mat6& covariance) {
  covariance_t message{};
  float* next = message.upper;
  for (int row = 0; row < 6; ++row)
    for (int col = row; col < 6; ++col) *next++ = static_cast<float>(covariance(row, col));
  return message;
}

std::optional<Mat6> FromMessage(const covariance_t& message) {
  if (!AllFinite(message.upper)) return std::nullopt;
  Mat6 covariance;
  const float* next = message.upper;
  for (int row = 0; row < 6; ++row)
    for (int col = row; col < 6; ++col) covariance(row, col) = covariance(col, row) = *next++;
  if ((covariance.diagonal().array() < 0).any()) return std::nullopt;
  return covariance;
}

submap_poses_t ToMessage(const std::vector<SubmapPlace>& places) {
  submap_poses_t message{};
  message.count = static_cast<int>(places.size());
  for (const SubmapPlace& place : places) {
    message.submap_id.push_back(place.id);
    message.X_WM.push_back(ToMessage(place.X_WM));
    message.covariance_WM.push_back(ToMessage(place.covariance_WM));
    message.covariance_MN.push_back(ToMessage(place.covariance_MN));
  }
  return message;
}

std::optional<std::vector<SubmapPlace>> FromMessage(const submap_poses_t& message) {
  std::vector<SubmapPlace> places;
  for (std::size_t i = 0; i < message.X_WM.size(); ++i) {
    const auto X_WM = FromMessage(message.X_WM[i]);
    const auto covariance_WM = FromMessage(message.covariance_WM[i]);
    const auto covariance_MN = FromMessage(message.covariance_MN[i]);
    if (!X_WM || !covariance_WM || !covariance_MN) return std::nullopt;
    places.push_back({message.submap_id[i], *X_WM, *covariance_WM, *covariance_MN});
  }
  return places;
}

revisits_t ToMessage(const std::map<SubmapId, double>& gains) {
  revisits_t message{};
  for (const auto& [id, gain] : gains) {
    message.submap_id.push_back(id);
    message.gain.push_back(gain);
  }
  message.count = static_cast<int>(gains.size());
  return message;
}

std::optional<std::map<SubmapId, double>> FromMessage(const revisits_t& message) {
  std::map<SubmapId, double> gains;
  for (std::size_t i = 0; i < message.submap_id.size(); ++i) {
    const double gain = message.gain[i];
    if (message.submap_id[i] < 0 || !(gain >= 0 && gain <= 1)) return std::nullopt;
    gains[message.submap_id[i]] = gain;
  }
  return gains;
}

vehicle_nav_t ToMessage(const VehicleNavRecord& record) {
  vehicle_nav_t message{};
  message.X_OB = ToMessage(record.X_OB);
  CopyTo(record.velocity_B_m_s, message.velocity_B_m_s);
  message.yaw_rate_rad_s = record.yaw_rate_rad_s;
  return message;
}

std::optional<VehicleNavRecord> FromMessage(const vehicle_nav_t& message) {
  const auto X_OB = FromMessage(message.X_OB);
  if (!X_OB || !AllFinite(message.velocity_B_m_s) || !std::isfinite(message.yaw_rate_rad_s))
    return std::nullopt;
  return VehicleNavRecord{TimeOf(message.header),
                          message.header.sequence,
                          message.header.epoch,
                          *X_OB,
                          VectorFrom(message.velocity_B_m_s),
                          message.yaw_rate_rad_s};
}

dvl_t ToMessage(const DvlRecord& record) {
  dvl_t message{};
  message.valid = record.valid;
  CopyTo(record.velocity_B_m_s, message.velocity_B_m_s);
  return message;
}

std::optional<DvlRecord> FromMessage(const dvl_t& message) {
  if (!AllFinite(message.velocity_B_m_s)) return std::nullopt;
  return DvlRecord{TimeOf(message.header), message.header.sequence,
                   VectorFrom(message.velocity_B_m_s), message.valid != 0};
}

imu_t ToMessage(const ImuRecord& record) {
  imu_t message{};
  message.roll_rad = record.roll_rad;
  message.pitch_rad = record.pitch_rad;
  CopyTo(record.angular_velocity_B_rad_s, message.angular_velocity_B_rad_s);
  return message;
}

std::optional<ImuRecord> FromMessage(const imu_t& message) {
  if (!std::isfinite(message.roll_rad) || !std::isfinite(message.pitch_rad) ||
      !AllFinite(message.angular_velocity_B_rad_s))
    return std::nullopt;
  return ImuRecord{TimeOf(message.header), message.header.sequence, message.roll_rad,
                   message.pitch_rad, VectorFrom(message.angular_velocity_B_rad_s)};
}

depth_t ToMessage(const DepthRecord& record) {
  depth_t message{};
  message.depth_m = record.depth_m;
  return message;
}

std::optional<DepthRecord> FromMessage(const depth_t& message) {
  if (!std::isfinite(message.depth_m)) return std::nullopt;
  return DepthRecord{TimeOf(message.header), message.header.sequence, message.depth_m};
}

sonar_returns_t ToMessage(const SonarReturns& returns) {
  sonar_returns_t message{};
  message.tilt_rad = returns.tilt_rad;
  message.min_range_m = returns.min_range_m;
  message.max_range_m = returns.max_range_m;
  message.beams = static_cast<int>(returns.range_m.size());
  message.range_m = returns.range_m;
  message.strength = returns.strength;
  return message;
}

std::optional<SonarReturns> FromMessage(const sonar_returns_t& message) {
  if (!std::isfinite(message.tilt_rad) || !IsWindow(message.min_range_m, message.max_range_m) ||
      !AllFinite(message.range_m) || !AllFinite(message.strength))
    return std::nullopt;
  return SonarReturns{TimeOf(message.header), message.header.sequence, message.tilt_rad,
                      message.min_range_m,    message.max_range_m,     message.range_m,
                      message.strength};
}

sonar_frame_t ToMessage(const SonarFrame& frame) {
  sonar_frame_t message{};
  message.tilt_rad = frame.tilt_rad;
  message.min_range_m = frame.min_range_m;
  message.max_range_m = frame.max_range_m;
  message.beams = frame.beams;
  message.bins = frame.bins;
  message.size = static_cast<int>(frame.samples.size());
  message.samples = frame.samples;
  return message;
}

std::optional<SonarFrame> FromMessage(const sonar_frame_t& message) {
  if (!std::isfinite(message.tilt_rad) || !IsWindow(message.min_range_m, message.max_range_m) ||
      message.beams < 1 || message.bins < 1 ||
      std::int64_t{message.beams} * message.bins != message.size)
    return std::nullopt;
  return SonarFrame{TimeOf(message.header), message.header.sequence, message.tilt_rad,
                    message.min_range_m,    message.max_range_m,     message.beams,
                    message.bins,           message.samples};
}

nav_t ToMessage(const OdometrySample& sample) {
  nav_t message{};
  message.origin = sample.origin;
  message.X_OB = ToMessage(sample.X_OB);
  CopyMatrix<3>(sample.covariance, message.covariance_xyyaw);
  CopyTo(sample.velocity_B_m_s, message.velocity_B_m_s);
  message.yaw_rate_rad_s = sample.yaw_rate_rad_s;
  return message;
}

std::optional<OdometrySample> FromMessage(const nav_t& message) {
  const auto X_OB = FromMessage(message.X_OB);
  if (!X_OB || !IsCovariance<3>(message.covariance_xyyaw) || !AllFinite(message.velocity_B_m_s) ||
      !std::isfinite(message.yaw_rate_rad_s))
    return std::nullopt;
  return OdometrySample{TimeOf(message.header),
                        message.origin,
                        message.header.epoch,
                        *X_OB,
                        MatrixFrom<3>(message.covariance_xyyaw),
                        VectorFrom(message.velocity_B_m_s),
                        message.yaw_rate_rad_s};
}

scan_t ToMessage(const Scan& scan) {
  scan_t message{};
  message.X_BS = ToMessage(scan.X_BS);
  message.min_range_m = scan.min_range_m;
  message.max_range_m = scan.max_range_m;
  message.beams = static_cast<int>(scan.beams.size());
  for (const Beam& beam : scan.beams) {
    message.bearing_rad.push_back(beam.bearing_rad);
    message.range_m.push_back(beam.range_m);
    message.strength.push_back(beam.strength);
    message.status.push_back(static_cast<std::int8_t>(beam.status));
  }
  return message;
}

std::optional<Scan> FromMessage(const scan_t& message) {
  const auto X_BS = FromMessage(message.X_BS);
  if (!X_BS || !IsWindow(message.min_range_m, message.max_range_m) ||
      !AllFinite(message.bearing_rad) || !AllFinite(message.strength))
    return std::nullopt;
  Scan scan{TimeOf(message.header), message.header.sequence, *X_BS,
            message.min_range_m,    message.max_range_m,     {}};
  for (int i = 0; i < message.beams; ++i) {
    const std::int8_t status = message.status[i];
    const float range_m = message.range_m[i];
    if (status < 0 || status > static_cast<int>(BeamStatus::kUncertain) ||
        !(range_m >= 0 && range_m <= message.max_range_m + 1e-3))
      return std::nullopt;
    scan.beams.push_back(
        {message.bearing_rad[i], range_m, message.strength[i], static_cast<BeamStatus>(status)});
  }
  return scan;
}

control_t ToMessage(const VelocityCommand& command) {
  control_t message{};
  CopyTo(command.velocity_B_m_s, message.velocity_B_m_s);
  message.yaw_rate_rad_s = command.yaw_rate_rad_s;
  return message;
}

std::optional<VelocityCommand> FromMessage(const control_t& message) {
  if (!AllFinite(message.velocity_B_m_s) || !std::isfinite(message.yaw_rate_rad_s))
    return std::nullopt;
  return VelocityCommand{VectorFrom(message.velocity_B_m_s), message.yaw_rate_rad_s};
}

submap_base_t ToMessage(const SubmapBase& base) {
  submap_base_t message{};
  message.submap_id = base.id;
  message.odometry = ToSampleMessage(base.odometry);
  message.edge_X_PM = ToMessage(base.edge.X_PM);
  CopyMatrix<6>(base.edge.covariance, message.edge_covariance);
  return message;
}

std::optional<SubmapBase> FromMessage(const submap_base_t& message) {
  const auto odometry = FromSampleMessage(message.odometry);
  const auto edge_X_PM = FromMessage(message.edge_X_PM);
  if (message.submap_id < 0 || !odometry || !edge_X_PM || !IsCovariance<6>(message.edge_covariance))
    return std::nullopt;
  return SubmapBase{
      message.submap_id, *odometry, {*edge_X_PM, MatrixFrom<6>(message.edge_covariance)}};
}

submap_t ToMessage(const Submap& submap, const std::string& octree_bytes) {
  submap_t message{};
  message.base = ToMessage(submap.base);
  message.first_utime_us = ToUtime(submap.first_scan);
  message.last_utime_us = ToUtime(submap.last_scan);
  message.scans = submap.scans;
  message.X_ML = ToMessage(submap.X_ML);
  CopyMatrix<3>(submap.drift, message.drift_xyyaw);
  message.octree_bytes = static_cast<int>(octree_bytes.size());
  const std::string compressed = Compress(octree_bytes);
  message.octree_zlib.assign(compressed.begin(), compressed.end());
  message.size = static_cast<int>(message.octree_zlib.size());
  return message;
}

std::optional<SubmapPtr> FromMessage(const submap_t& message) {
  const auto base = FromMessage(message.base);
  if (message.octree_bytes < 0 || message.octree_bytes > kMaxOctreeBytes) return std::nullopt;
  const auto bytes =
      Decompress(AsText(message.octree_zlib), static_cast<std::size_t>(message.octree_bytes));
  if (!bytes) return std::nullopt;
  auto grid = FromOctreeBytes(*bytes);
  const auto X_ML = FromMessage(message.X_ML);
  if (!base || !X_ML || !IsCovariance<3>(message.drift_xyyaw) || !IsUtime(message.first_utime_us) ||
      !IsUtime(message.last_utime_us) || !std::holds_alternative<BrickGrid>(grid))
    return std::nullopt;
  return std::make_shared<Submap>(Submap{.base = *base,
                                         .first_scan = FromUtime(message.first_utime_us),
                                         .last_scan = FromUtime(message.last_utime_us),
                                         .scans = message.scans,
                                         .X_ML = *X_ML,
                                         .drift = MatrixFrom<3>(message.drift_xyyaw),
                                         .grid = std::move(std::get<BrickGrid>(grid))});
}

}  // namespace vog
