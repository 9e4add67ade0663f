#include "procs/planner/planner_node.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "lib/baselines/make_submap_map.h"
#include "lib/bus/lcm_bus.h"
#include "lib/control/path_follower.h"

namespace vog {
namespace {

/// How long scans may fail to come before the vehicle stays where it is.
constexpr Duration kPatience = std::chrono::seconds(5);
/// The same of the map and of POSE, in seconds of the bus: MAP_STATUS is told in those, however
/// fast a simulated vehicle's time goes, and without POSE that time stands still.
constexpr int kBusPatience_s = 5;

const char* NameOf(ExplorerState state) {
  switch (state) {
    case ExplorerState::kExploring:
      return "exploring";
    case ExplorerState::kLocalising:
      return "localising";
    case ExplorerState::kRevisiting:
      return "revisiting";
    case ExplorerState::kReturning:
      return "returning";
    case ExplorerState::kFinished:
      break;
  }
  return "finished";
}

tree_node_t ToMessage(const TreeNode& node) {
  tree_node_t message{};
  message.parent = node.parent;
  for (int i = 0; i < 3; ++i) message.position_m[i] = static_cast<float>(node.at.position_W_m[i]);
  message.yaw_rad = static_cast<float>(node.at.yaw_rad);
  message.gain = static_cast<float>(node.gain);
  message.visible = node.visible;
  return message;
}

plan_t ToMessage(const Plan& plan) {
  plan_t message{};
  message.plan_id = plan.id;
  for (const Waypoint& waypoint : plan.path) {
    waypoint_t point{};
    std::copy_n(waypoint.position_W_m.data(), 3, point.position_m);
    point.yaw_rad = waypoint.yaw_rad;
    message.path.push_back(point);
  }
  message.waypoints = static_cast<int>(message.path.size());
  for (const TreeNode& node : plan.tree) message.tree.push_back(ToMessage(node));
  message.nodes = static_cast<int>(message.tree.size());
  message.best = plan.best;
  return message;
}

}  // namespace

PlannerSettings PlannerSettings::From(const Config& config) {
  const auto controller = config.Read<ControllerOptions>("controller");
  return {config.Read<MissionOptions>("mission"),
          config.Read<PlannerOptions>("planner"),
          {controller.max_speed_m_s, controller.max_yaw_rate_rad_s},
          ExplorationOptions::From(config),
          config.Read<SonarOptions>("sonar"),
          config.Read<SubmapOptions>("submap"),
          config.Read<SensorModelOptions>("sensor_model"),
          config.Read<MapOptions>("map"),
          config.Read<FuseOptions>("fuse"),
          config.Read<BusOptions>("bus").run_id};
}

PlannerNode::PlannerNode(Bus& bus, const PlannerSettings& settings)
    : settings_(settings),
      endpoint_(bus, "vog-planner", settings.run_id),
      explorer_(settings.planner, settings.limits, settings.exploration, settings.sonar,
                settings.mission),
      map_(MakeSubmapMap(settings.map.method, settings.submap.voxel_size_m,
                         SensorModel(settings.sensor_model))),
      submaps_(*map_, settings.fuse, SensorModel(settings.sensor_model)),
      cautious_map_(*map_, MakeSubmapMap(settings.map.method, settings.submap.voxel_size_m,
                                         SensorModel(settings.sensor_model))),
      open_(settings.submap.voxel_size_m, settings.sensor_model),
      standard_map_(settings.submap.voxel_size_m, settings.sensor_model),
      receiver_(endpoint_,
                {[this](const SubmapPtr& submap) { OnSubmap(submap); }, [this] { OnReset(); },
                 [this](const map_status_t& status) { OnMapStatus(status); }}) {
  endpoint_.Subscribe(outputs::kSubmapPoses,
                      [this](Time, const submap_poses_t& message) { OnSubmapPoses(message); });
  endpoint_.Subscribe(outputs::kRevisits,
                      [this](Time, const revisits_t& message) { OnRevisits(message); });
  endpoint_.Subscribe(outputs::kScan, [this](Time, const scan_t& message) { OnScan(message); });
  endpoint_.Subscribe(outputs::kNav, [this](Time, const nav_t& message) { OnNav(message); });
  endpoint_.Subscribe(outputs::kPose,
                      [this](Time, const pose_estimate_t& message) { OnPose(message); });
  endpoint_.Subscribe(outputs::kOperator,
                      [this](Time, const operator_command_t& message) { OnOperator(message); });
  bus.WhenCaughtUp([this] { PlanWithNewestPose(); });
  bus.Every(std::chrono::seconds(1), [this](Time) {
    ++seconds_without_map_;
    ++seconds_without_pose_;
    if (explorer_.plan() != nullptr) PublishPlan(*explorer_.plan(), newest_pose_);
    PublishMissionStatus(newest_pose_);
    if (pose_version_ != poses_version_) AskForPoses(endpoint_, newest_pose_);
  });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["submaps"] = submaps_.size();
    counters["map_digest"] = receiver_.digest();
    counters["poses_version"] = poses_version_;
    counters["fused"] = submaps_.fused();
    counters["scans_dropped"] = synchronizer_.dropped();
    counters["poses_skipped"] = poses_skipped_;
    counters["leaps"] = leaps_;
    counters["orders"] = orders_;
    counters["refused_orders"] = refused_orders_;
    if (!receiver_.IsComplete()) return std::string("waiting for submaps");
    if (has_start_ && seconds_without_pose_ >= kBusPatience_s)
      return std::string("waiting for POSE");
    return explorer_.hold().empty() ? std::string("ok") : "holding: " + explorer_.hold();
  });
}

void PlannerNode::OnSubmap(const SubmapPtr& submap) {
  // Its grid goes; the next POSE shows the new one.
  map_->SetOpen(nullptr, Pose3::Identity());
  shown_revision_ = -1;
  open_.ForgetUpTo(submap->last_scan);
  const SubmapId id = submap->id();
  if (const auto told = X_WM_.find(id); told != X_WM_.end()) {
    submaps_.Place(submap, told->second);
  } else if (submaps_.Has(id - 1)) {
    submaps_.Place(submap, submaps_.X_WM(id - 1) * submap->base.edge.X_PM);
  } else {
    submaps_.Place(submap, submap->base.odometry.X_OB);  // Until SLAM tells better.
  }
}

void PlannerNode::OnMapStatus(const map_status_t& status) {
  is_complete_ = status.complete;
  first_ = status.first;
  if (receiver_.IsComplete()) seconds_without_map_ = 0;
}

void PlannerNode::OnReset() { submaps_.Clear(); }

void PlannerNode::OnSubmapPoses(const submap_poses_t& message) {
  if (message.header.epoch == poses_epoch_ && message.version <= poses_version_) return;
  const auto places = FromMessage(message);
  if (!places) {
    endpoint_.NoteMalformed();
    return;
  }
  poses_epoch_ = message.header.epoch;
  poses_version_ = message.version;
  X_WM_.clear();
  std::vector<std::pair<SubmapId, double>> sigmas_m;
  for (const SubmapPlace& place : *places) {
    X_WM_[place.id] = place.X_WM;
    sigmas_m.emplace_back(place.id, HorizontalSigma(place.covariance_MN));
  }
  submaps_.Move(X_WM_, sigmas_m);
  if (!UsesStandardMap()) explorer_.SetSubmaps(X_WM_);
}

void PlannerNode::OnRevisits(const revisits_t& message) {
  const auto gains = FromMessage(message);
  if (!gains) {
    endpoint_.NoteMalformed();
    return;
  }
  if (UsesStandardMap()) return;  // No loop closure bends it.
  std::vector<RevisitPlace> places;
  for (const auto& [id, gain] : *gains) {
    if (!submaps_.Has(id)) continue;
    const Pose3& X_WM = submaps_.X_WM(id);
    places.push_back({id, WaypointOf(X_WM), WaypointOf(X_WM * submaps_.outline(id)->X_ML), gain});
  }
  explorer_.SetRevisits(std::move(places));
}

void PlannerNode::OnScan(const scan_t& message) {
  auto scan = FromMessage(message);
  if (!scan) {
    endpoint_.NoteMalformed();
    return;
  }
  newest_scan_ = std::max(newest_scan_, scan->time);
  synchronizer_.Add(std::move(*scan));
  AddScans();
}

void PlannerNode::OnNav(const nav_t& message) {
  const auto sample = FromMessage(message);
  if (!sample) {
    endpoint_.NoteMalformed();
    return;
  }
  synchronizer_.Add(*sample);
  AddScans();
}

void PlannerNode::AddScans() {
  while (const auto registered = synchronizer_.Next()) {
    if (UsesStandardMap()) {
      standard_map_.Insert(registered->scan, registered->odometry.X_OB);
    } else {
      AddToOpen(*registered);
    }
  }
}

void PlannerNode::AddToOpen(const RegisteredScan& registered) {
  try {
    open_.Add(registered);
  } catch (const std::length_error&) {
    // The odometry has leapt farther than a submap can be wide; the map service begins a new one.
    ++leaps_;
    open_.ForgetUpTo(registered.scan.time);
  }
}

void PlannerNode::ShowOpen(const Pose3& X_WO, std::int64_t segment) {
  const bool is_shown = open_.grid() != nullptr && open_.base().segment == segment;
  const Pose3 X_WM = is_shown ? Pose3(X_WO * open_.base().X_OB) : Pose3::Identity();
  // A POSE between two scans changes nothing that the map remembers.
  if (is_shown == is_open_shown_ && open_.revision() == shown_revision_ &&
      X_WM.matrix() == X_open_shown_.matrix())
    return;
  map_->SetOpen(is_shown ? open_.grid() : nullptr, X_WM);
  is_open_shown_ = is_shown;
  shown_revision_ = open_.revision();
  X_open_shown_ = X_WM;
}

void PlannerNode::OnPose(const pose_estimate_t& message) {
  const auto X_WB = FromMessage(message.X_WB);
  const auto X_WO = FromMessage(message.X_WO);
  if (!X_WB || !X_WO) {
    endpoint_.NoteMalformed();
    return;
  }
  newest_pose_ = TimeOf(message.header);
  seconds_without_pose_ = 0;
  pose_version_ = message.version;
  if (newest_estimate_) ++poses_skipped_;
  newest_estimate_ = {newest_pose_, *X_WB, *X_WO, message.segment,
                      MatrixFrom<3>(message.covariance_xyyaw)};
}

bool PlannerNode::MayPlan() const {
  // A planner that is started again after the mission does not begin another.
  if (is_complete_) return false;
  // The mission ends with its budget, whether the last submaps are here or not.
  if (receiver_.announced() >= settings_.mission.max_submaps) return true;
  // The first plan is made on the whole map at SLAM's poses.
  if (receiver_.IsComplete())
    return has_start_ || static_cast<int>(X_WM_.size()) >= receiver_.announced();
  // Submaps that are on their way come in a moment.
  return has_start_ && seconds_without_map_ >= kBusPatience_s;
}

void PlannerNode::PlanWithNewestPose() {
  const auto estimate = std::exchange(newest_estimate_, std::nullopt);
  if (!estimate || !MayPlan()) return;
  const auto& [time, X_WB, X_WO, segment, covariance_xyyaw] = *estimate;
  if (!has_start_) SetStart(X_WB);
  ShowOpen(X_WO, segment);
  map_->SetSigmaSince(std::sqrt(std::max({0.0, covariance_xyyaw(0, 0), covariance_xyyaw(1, 1)})));
  cautious_map_.Follow(settings_.planner.sure_sigma_m());
  const ExplorerState before = explorer_.state();
  const std::string held = explorer_.hold();
  const Plan* plan =
      explorer_.Update(planning_map(), UsesStandardMap() ? X_WO.inverse() * X_WB : X_WB, time,
                       receiver_.announced(), ReasonToHold());
  if (plan != nullptr) PublishPlan(*plan, time);
  MeasureExplored();
  if (explorer_.state() != before || explorer_.hold() != held) PublishMissionStatus(time);
}

void PlannerNode::SetStart(const Pose3& X_WB) {
  // Who comes late knows starts from the first submaps.
  const auto start_W = [&](SubmapId first) -> Vec3 {
    return submaps_.Has(first) ? submaps_.X_WM(first).translation() : X_WB.translation();
  };
  explorer_.SetStart(start_W(0), start_W(first_));
  has_start_ = true;
  newest_scan_ = std::max(newest_scan_, newest_pose_);
}

std::string PlannerNode::ReasonToHold() const {
  if (is_paused_) return "paused";
  if (seconds_without_map_ >= kBusPatience_s) return "no map";
  if (newest_pose_ - newest_scan_ >= kPatience) return "no sonar";
  return {};
}

void PlannerNode::OnOperator(const operator_command_t& message) {
  ++orders_;
  try {
    Obey(message);
    refused_.clear();
  } catch (const UsageError& error) {
    ++refused_orders_;
    refused_ = error.what();
  }
  PublishMissionStatus(newest_pose_);
}

void PlannerNode::Obey(const operator_command_t& message) {
  if (explorer_.state() == ExplorerState::kFinished) throw UsageError("the mission is over");
  if (message.command == "pause") {
    is_paused_ = true;
  } else if (message.command == "resume") {
    is_paused_ = false;
  } else if (message.command == "go_home") {
    is_paused_ = false;
    explorer_.EndWith("go_home", /*goes_home=*/true);
  } else if (message.command == "abort") {
    explorer_.EndWith("abort", /*goes_home=*/false);
    if (explorer_.plan() != nullptr) PublishPlan(*explorer_.plan(), newest_pose_);
  } else if (message.command == "set") {
    ChangeSettings(message.settings);
  } else {
    throw UsageError("unknown order \"" + message.command +
                     "\"; there are pause, resume, go_home, abort and set");
  }
}

void PlannerNode::ChangeSettings(const std::string& toml) {
  constexpr std::string_view kTables[] = {"exploration", "keep_out", "planner"};
  const Config config = Config::Parse(toml, "order");
  config.RejectUnknownTables(kTables);
  const auto exploration = ExplorationOptions::From(config, settings_.exploration);
  settings_.planner = config.Read<PlannerOptions>("planner", settings_.planner);
  settings_.exploration = exploration;
  explorer_.SetRules(settings_.planner, settings_.exploration);
}

const OccupancyMap& PlannerNode::planning_map() const {
  if (UsesStandardMap()) return standard_map_;
  return cautious_map_;
}

void PlannerNode::MeasureExplored() {
  if (measured_submaps_ == receiver_.announced()) return;
  measured_submaps_ = receiver_.announced();
  explored_m3_ = explorer_.ExploredVolume(planning_map());
}

void PlannerNode::PublishPlan(const Plan& plan, Time time) {
  plan_t message = ToMessage(plan);
  message.in_odometry_frame = UsesStandardMap();
  endpoint_.Publish(outputs::kPlan, message, time);
}

void PlannerNode::PublishMissionStatus(Time time) {
  mission_status_t status{};
  status.state = is_complete_ ? "finished" : has_start_ ? NameOf(explorer_.state()) : "waiting";
  status.hold = explorer_.hold();
  status.end_reason = explorer_.end_reason();
  status.is_home = explorer_.is_home();
  status.orders = orders_;
  status.refused = refused_;
  status.plans = explorer_.plan() != nullptr ? explorer_.plan()->id : 0;
  status.submaps = std::max(0, receiver_.announced());
  status.unseen_voxels = explorer_.unseen().voxels;
  status.unseen_in_vain = explorer_.unseen().in_vain;
  status.explored_m3 = explored_m3_;
  endpoint_.Publish(outputs::kMissionStatus, status, time);
}

}  // namespace vog
