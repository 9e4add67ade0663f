#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "lib/geometry/odometry.h"
#include "lib/navigation/records.h"
#include "lib/scan/scan.h"
#include "lib/scan/sonar_records.h"
#include "lib/submap/submap.h"
#include "vog/control_t.hpp"
#include "vog/covariance_t.hpp"
#include "vog/depth_t.hpp"
#include "vog/dvl_t.hpp"
#include "vog/imu_t.hpp"
#include "vog/nav_t.hpp"
#include "vog/revisits_t.hpp"
#include "vog/scan_t.hpp"
#include "vog/sonar_frame_t.hpp"
#include "vog/sonar_returns_t.hpp"
#include "vog/submap_poses_t.hpp"
#include "vog/submap_t.hpp"
#include "vog/vehicle_nav_t.hpp"

namespace vog {

// Between messages and the types of lib/. Headers are left to Endpoint. What comes from a message
// is checked: a value that no sender of ours can mean (not finite, no rotation, lengths that
// disagree) gives nullopt.

inline Time TimeOf(const header_t& header) { return FromUtime(header.utime_us); }

pose_t ToMessage(const Pose3& X_AB);
std::optional<Pose3> FromMessage(const pose_t& message);

template <int N>
using RowMajor = Eigen::Matrix<double, N, N, Eigen::RowMajor>;
template <int N>
void CopyMatrix(const Eigen::Matrix<double, N, N>& matrix, double (&numbers)[N * N]) {
  Eigen::Map<RowMajor<N>> map(numbers);
  map = matrix;
}
template <int N>
Eigen::Matrix<double, N, N> MatrixFrom(const double (&numbers)[N * N]) {
  return Eigen::Map<const RowMajor<N>>(numbers);
}

covariance_t ToMessage(const Mat6& covariance);
std::optional<Mat6> FromMessage(const covariance_t& message);

/// What SUBMAP_POSES tells of a submap.
struct SubmapPlace {
  SubmapId id = 0;
  Pose3 X_WM = Pose3::Identity();
  Mat6 covariance_WM = Mat6::Zero();  ///< The world stands where the first submap began.
  Mat6 covariance_MN = Mat6::Zero();  ///< Of the motion to the newest submap's base N.
};
submap_poses_t ToMessage(const std::vector<SubmapPlace>& places);
std::optional<std::vector<SubmapPlace>> FromMessage(const submap_poses_t& message);

/// What REVISITS tells: the gain of seeing submaps again, a share from 0 to 1.
revisits_t ToMessage(const std::map<SubmapId, double>& gains);
std::optional<std::map<SubmapId, double>> FromMessage(const revisits_t& message);

/// The origin travels as header.epoch.
vehicle_nav_t ToMessage(const VehicleNavRecord& record);
std::optional<VehicleNavRecord> FromMessage(const vehicle_nav_t& message);

dvl_t ToMessage(const DvlRecord& record);
std::optional<DvlRecord> FromMessage(const dvl_t& message);

imu_t ToMessage(const ImuRecord& record);
std::optional<ImuRecord> FromMessage(const imu_t& message);

depth_t ToMessage(const DepthRecord& record);
std::optional<DepthRecord> FromMessage(const depth_t& message);

sonar_returns_t ToMessage(const SonarReturns& returns);
std::optional<SonarReturns> FromMessage(const sonar_returns_t& message);

sonar_frame_t ToMessage(const SonarFrame& frame);
std::optional<SonarFrame> FromMessage(const sonar_frame_t& message);

/// The segment travels as header.epoch.
nav_t ToMessage(const OdometrySample& sample);
std::optional<OdometrySample> FromMessage(const nav_t& message);

scan_t ToMessage(const Scan& scan);
std::optional<Scan> FromMessage(const scan_t& message);

control_t ToMessage(const VelocityCommand& command);
std::optional<VelocityCommand> FromMessage(const control_t& message);

submap_base_t ToMessage(const SubmapBase& base);
std::optional<SubmapBase> FromMessage(const submap_base_t& message);

/// `octree_bytes` is what ToOctreeBytes() gives for the submap.
submap_t ToMessage(const Submap& submap, const std::string& octree_bytes);
std::optional<SubmapPtr> FromMessage(const submap_t& message);

}  // namespace vog
