#pragma once

#include "vog/chunk_t.hpp"
#include "vog/control_t.hpp"
#include "vog/depth_t.hpp"
#include "vog/dvl_t.hpp"
#include "vog/graph_t.hpp"
#include "vog/imu_t.hpp"
#include "vog/map_reply_t.hpp"
#include "vog/map_request_t.hpp"
#include "vog/map_status_t.hpp"
#include "vog/mission_status_t.hpp"
#include "vog/nav_t.hpp"
#include "vog/operator_command_t.hpp"
#include "vog/plan_t.hpp"
#include "vog/pose_estimate_t.hpp"
#include "vog/revisits_t.hpp"
#include "vog/run_t.hpp"
#include "vog/scan_t.hpp"
#include "vog/sonar_frame_t.hpp"
#include "vog/sonar_returns_t.hpp"
#include "vog/status_t.hpp"
#include "vog/submap_poses_t.hpp"
#include "vog/truth_t.hpp"
#include "vog/vehicle_nav_t.hpp"

namespace vog {

/// A channel's name and the type that travels on it.
template <class Message>
struct Channel {
  const char* name;
};

/// What the vehicle says: the inputs of a replay, which computes all others anew.
namespace inputs {
inline constexpr Channel<run_t> kRun{"RUN"};
inline constexpr Channel<vehicle_nav_t> kVehicleNav{"VEHICLE_NAV"};
inline constexpr Channel<dvl_t> kDvl{"DVL"};
inline constexpr Channel<imu_t> kImu{"IMU"};
inline constexpr Channel<depth_t> kDepth{"DEPTH"};
inline constexpr Channel<sonar_returns_t> kSonarReturns{"SONAR_RETURNS"};
inline constexpr Channel<sonar_frame_t> kSonarFrame{"SONAR_FRAME"};
inline constexpr Channel<truth_t> kTruth{"TRUTH"};
}  // namespace inputs

/// What the processes make of it.
namespace outputs {
inline constexpr Channel<nav_t> kNav{"NAV"};
inline constexpr Channel<scan_t> kScan{"SCAN"};
inline constexpr Channel<chunk_t> kSubmap{"SUBMAP"};  // Parts of a submap_t.
inline constexpr Channel<submap_poses_t> kSubmapPoses{"SUBMAP_POSES"};
inline constexpr Channel<graph_t> kGraph{"GRAPH"};
inline constexpr Channel<revisits_t> kRevisits{"REVISITS"};
inline constexpr Channel<pose_estimate_t> kPose{"POSE"};
inline constexpr Channel<plan_t> kPlan{"PLAN"};
inline constexpr Channel<mission_status_t> kMissionStatus{"MISSION_STATUS"};
inline constexpr Channel<operator_command_t> kOperator{"OPERATOR"};
inline constexpr Channel<control_t> kControl{"CONTROL"};
inline constexpr Channel<control_t> kVehicleCommand{"VEHICLE_COMMAND"};
inline constexpr Channel<map_status_t> kMapStatus{"MAP_STATUS"};
inline constexpr Channel<map_request_t> kMapRequest{"MAP_REQUEST"};
inline constexpr Channel<chunk_t> kMapReply{"MAP_REPLY"};  // Parts of a map_reply_t.
inline constexpr Channel<status_t> kStatus{"STATUS"};
}  // namespace outputs

/// Calls `use` with each channel.
template <class Use>
void ForEachChannel(const Use& use) {
  const auto for_each = [&use](const auto&... channels) { (use(channels), ...); };
  for_each(inputs::kRun, inputs::kVehicleNav, inputs::kDvl, inputs::kImu, inputs::kDepth,
           inputs::kSonarReturns, inputs::kSonarFrame, inputs::kTruth);
  for_each(outputs::kNav, outputs::kScan, outputs::kSubmap, outputs::kSubmapPoses, outputs::kGraph,
           outputs::kRevisits, outputs::kPose, outputs::kPlan, outputs::kMissionStatus,
           outputs::kOperator, outputs::kControl, outputs::kVehicleCommand, outputs::kMapStatus,
           outputs::kMapRequest, outputs::kMapReply, outputs::kStatus);
}

/// The channels of `inputs`, without their package's outputs, as one regular expression.
inline constexpr const char* kInputsRegex =
    "RUN|VEHICLE_NAV|DVL|IMU|DEPTH|SONAR_RETURNS|SONAR_FRAME|TRUTH";

}  // namespace vog
