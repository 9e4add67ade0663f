#include "procs/controller/controller_node.h"

#include <algorithm>
#include <cmath>

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"

namespace vog {
namespace {

// After a longer gap between poses the target must not leap ahead.
constexpr double kMaxStep_s = 0.5;

std::optional<std::vector<Waypoint>> PathOf(const plan_t& message) {
  std::vector<Waypoint> path;
  for (const waypoint_t& waypoint : message.path) {
    const Vec3 position_W = Eigen::Map<const Vec3>(waypoint.position_m);
    if (!position_W.allFinite() || !std::isfinite(waypoint.yaw_rad)) return std::nullopt;
    path.push_back({position_W, waypoint.yaw_rad});
  }
  return path;
}

}  // namespace

ControllerSettings ControllerSettings::From(const Config& config) {
  return {config.Read<ControllerOptions>("controller"), config.Read<BusOptions>("bus").run_id};
}

ControllerNode::ControllerNode(Bus& bus, const ControllerSettings& settings)
    : endpoint_(bus, "vog-controller", settings.run_id), follower_(settings.controller) {
  endpoint_.Subscribe(outputs::kPlan, [this](Time, const plan_t& message) { OnPlan(message); });
  endpoint_.Subscribe(outputs::kPose,
                      [this](Time, const pose_estimate_t& message) { OnPose(message); });
  endpoint_.ReportStatus([this](auto&) { return plan_ ? "ok" : "waiting for a plan"; });
}

void ControllerNode::OnPlan(const plan_t& message) {
  const PlanKey key{message.header.epoch, message.plan_id};
  if (plan_ == key) return;  // Told again for those who come late.
  auto path = PathOf(message);
  if (!path) {
    endpoint_.NoteMalformed();
    return;
  }
  plan_ = key;
  in_odometry_frame_ = message.in_odometry_frame;
  follower_.Follow(std::move(*path));
}

void ControllerNode::OnPose(const pose_estimate_t& message) {
  const auto X_WB = FromMessage(message.X_WB);
  const auto X_WO = FromMessage(message.X_WO);
  if (!X_WB || !X_WO) {
    endpoint_.NoteMalformed();
    return;
  }
  const Time time = TimeOf(message.header);
  const double dt_s = last_pose_ ? std::clamp(ToSeconds(time - *last_pose_), 0.0, kMaxStep_s) : 0;
  last_pose_ = time;
  const Pose3 X_path_B = in_odometry_frame_ ? X_WO->inverse() * *X_WB : *X_WB;
  endpoint_.Publish(outputs::kControl, ToMessage(follower_.Step(X_path_B, dt_s)), time);
}

}  // namespace vog
