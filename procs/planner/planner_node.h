#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "lib/base/config.h"
#include "lib/baselines/standard_map.h"
#include "lib/messages/convert.h"
#include "lib/messages/submap_receiver.h"
#include "lib/planner/explorer.h"
#include "lib/planner/mission_options.h"
#include "lib/scan/scan_synchronizer.h"
#include "lib/submap/open_submap.h"
#include "lib/submap/submap_builder.h"
#include "lib/vogmap/cautious_map.h"
#include "lib/vogmap/map_options.h"
#include "lib/vogmap/submap_fuser.h"
#include "lib/vogmap/submap_map.h"

namespace vog {

struct PlannerSettings {
  MissionOptions mission;
  PlannerOptions planner;
  MotionLimits limits;
  ExplorationOptions exploration;
  SonarOptions sonar;
  SubmapOptions submap;
  SensorModelOptions sensor_model;
  MapOptions map;
  FuseOptions fuse;
  std::int64_t run_id = 0;

  static PlannerSettings From(const Config& config);
};

/// Explores: plans on its own replica of the map and tells the path and the state of the mission.
/// In: SUBMAP, MAP_STATUS, SUBMAP_POSES, REVISITS, SCAN, NAV, POSE, OPERATOR. Out: PLAN,
/// MISSION_STATUS, MAP_REQUEST, STATUS.
class PlannerNode {
 public:
  PlannerNode(Bus& bus, const PlannerSettings& settings);

  /// What it plans on with each POSE.
  const OccupancyMap& planning_map() const;

 private:
  bool UsesStandardMap() const { return settings_.mission.mode == MissionMode::kStandard; }
  void OnSubmap(const SubmapPtr& submap);
  void OnMapStatus(const map_status_t& status);
  void OnReset();
  void OnSubmapPoses(const submap_poses_t& message);
  void OnRevisits(const revisits_t& message);
  void OnScan(const scan_t& message);
  void OnNav(const nav_t& message);
  void AddScans();
  void AddToOpen(const RegisteredScan& registered);
  void OnPose(const pose_estimate_t& message);
  void OnOperator(const operator_command_t& message);
  /// Follows the order; otherwise throws UsageError.
  void Obey(const operator_command_t& message);
  void ChangeSettings(const std::string& toml);
  /// Why the vehicle must stay where it is; empty when it need not.
  std::string ReasonToHold() const;
  void PlanWithNewestPose();
  bool MayPlan() const;
  void SetStart(const Pose3& X_WB);
  void MeasureExplored();
  void ShowOpen(const Pose3& X_WO, std::int64_t segment);
  void PublishPlan(const Plan& plan, Time time);
  void PublishMissionStatus(Time time);

  PlannerSettings settings_;
  Endpoint endpoint_;
  Explorer explorer_;
  ScanSynchronizer synchronizer_;
  std::unique_ptr<SubmapMap> map_;
  SubmapFuser submaps_;  // Shown in map_.
  CautiousMap cautious_map_;
  OpenSubmap open_;
  // What ShowOpen() showed last.
  bool is_open_shown_ = false;
  std::int64_t shown_revision_ = -1;
  Pose3 X_open_shown_ = Pose3::Identity();
  StandardMap standard_map_;
  std::map<SubmapId, Pose3> X_WM_;  // Newest poses from SLAM.
  std::int64_t poses_epoch_ = -1, poses_version_ = 0;
  std::int64_t pose_version_ = 0;  // Of the poses that POSE stands on: they may have been missed.
  struct PoseEstimate {
    Time time;
    Pose3 X_WB, X_WO;
    std::int64_t segment;
    Mat3 covariance_xyyaw;  // Since the submap that it stands on.
  };
  std::optional<PoseEstimate> newest_estimate_;  // Until it has been planned with.
  std::int64_t poses_skipped_ = 0;
  std::int64_t leaps_ = 0;
  SubmapId first_ = 0;  // Of this flight.
  bool has_start_ = false;
  bool is_complete_ = false;   // The mission is over and its map saved.
  int measured_submaps_ = -1;  // When explored_m3_ was measured.
  double explored_m3_ = 0;
  Time newest_pose_, newest_scan_;
  // Of the bus: since the map service told of a map that is all here, and since POSE.
  int seconds_without_map_ = 0, seconds_without_pose_ = 0;
  bool is_paused_ = false;
  std::int64_t orders_ = 0, refused_orders_ = 0;
  std::string refused_;  // Why the last order was not followed.
  SubmapReceiver receiver_;
};

}  // namespace vog
