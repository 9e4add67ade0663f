#pragma once

#include <optional>

#include "lib/base/config.h"
#include "lib/control/path_follower.h"
#include "lib/messages/endpoint.h"

namespace vog {

struct ControllerSettings {
  ControllerOptions controller;
  std::int64_t run_id = 0;

  static ControllerSettings From(const Config& config);
};

/// Flies the newest plan: each pose gives one command.
/// In: PLAN, POSE. Out: CONTROL, STATUS.
class ControllerNode {
 public:
  ControllerNode(Bus& bus, const ControllerSettings& settings);

 private:
  /// Which plan of which planner.
  struct PlanKey {
    std::int64_t epoch, id;
    bool operator==(const PlanKey&) const = default;
  };

  void OnPlan(const plan_t& message);
  void OnPose(const pose_estimate_t& message);

  Endpoint endpoint_;
  PathFollower follower_;
  std::optional<PlanKey> plan_;
  bool in_odometry_frame_ = false;
  std::optional<Time> last_pose_;
};

}  // namespace vog
