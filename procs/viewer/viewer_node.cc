#include "procs/viewer/viewer_node.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "lib/bus/lcm_bus.h"
#include "lib/planner/mission_options.h"
#include "lib/planner/planner_options.h"
#include "lib/submap/submap_builder.h"

namespace vog {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 4> kCommands = {"pause", "resume", "go_home", "abort"};
constexpr double kLatest_us = 9e15;
// Blocks of frontiers looked at between two looks at messages: some milliseconds.
constexpr int kFrontierBlocks = 4;

std::size_t Megabytes(int megabytes) { return static_cast<std::size_t>(megabytes) << 20; }

}  // namespace

ViewerSettings ViewerSettings::From(const Config& config) {
  ViewerSettings settings{
      config.Read<ViewerOptions>("viewer"), {}, config.Read<BusOptions>("bus").run_id};
  const auto mission = config.Read<MissionOptions>("mission");
  const auto exploration = ExplorationOptions::From(config);
  settings.view.name = mission.name;
  settings.view.max_submaps = mission.max_submaps;
  settings.view.voxel_size_m = config.Read<SubmapOptions>("submap").voxel_size_m;
  settings.view.sensor_model = config.Read<SensorModelOptions>("sensor_model");
  settings.view.exploration_W = exploration.box_W();
  settings.view.keep_out_W = exploration.keep_out_W();
  return settings;
}

ViewerNode::ViewerNode(Bus& bus, const ViewerSettings& settings)
    : settings_(settings),
      endpoint_(bus, "vog-viewer", settings.run_id),
      model_(settings.view, Megabytes(settings.viewer.history_mb)),
      receiver_(endpoint_, {[this](const SubmapPtr& submap) {
                              model_.OnSubmap(submap);
                              new_submap_ = submap;
                            },
                            [this] {
                              model_.OnSubmapsReset();
                              converter_.ForgetSubmaps(now_);
                            },
                            [this](const map_status_t& status) { model_.OnMap(status); }}),
      server_(settings.viewer, model_.board(), feed_, EmbeddedPages(),
              [this](const std::string& text) { return OnRequest(text); }) {
  converter_.SetOccupiedFrom(SensorModel(settings.view.sensor_model).occupied_from);
  endpoint_.Observe([this](Time now, const std::string& channel, const header_t& header,
                           Bytes bytes) { PassOn(now, channel, header.sender, bytes); });
  Subscribe();
  if (settings.view.source != ViewSource::kLive) return;  // A log is of others.
  bus.Every(std::chrono::seconds(1), [this](Time now) { AskForMissingPoses(now); });
  endpoint_.ReportStatus([this](auto& counters) {
    const PageServer::Counts& counts = server_.counts();
    counters["submaps"] = static_cast<std::int64_t>(model_.submaps());
    counters["clients"] = counts.clients;
    counters["clients_refused"] = counts.refused;
    counters["requests_refused"] = counts.malformed + refused_;
    counters["frames_sent"] = counts.frames;
    counters["messages_skipped"] = counts.skipped;
    counters["sent_kb"] = counts.bytes / 1000;
    counters["history_kb"] = static_cast<std::int64_t>(model_.history().bytes() / 1000);
    return receiver_.IsComplete() ? "ok" : "waiting for submaps";
  });
}

void ViewerNode::Subscribe() {
  // Passes on what is possible, converted.
  const auto subscribe = [this](const auto& channel, auto handler) {
    endpoint_.Subscribe(channel, [this, handler](Time, const auto& message) {
      if (const auto value = FromMessage(message)) {
        handler(*value);
      } else {
        endpoint_.NoteMalformed();
      }
    });
  };
  subscribe(outputs::kNav, [this](const OdometrySample& sample) { model_.OnOdometry(sample); });
  subscribe(outputs::kScan, [this](const Scan& scan) { model_.OnScan(scan); });
  endpoint_.Subscribe(inputs::kTruth, [this](Time, const truth_t& message) {
    if (const auto X_WB = FromMessage(message.X_WB)) {
      model_.OnTruth(TimeOf(message.header), *X_WB);
    } else {
      endpoint_.NoteMalformed();
    }
  });
  endpoint_.Subscribe(outputs::kSubmapPoses,
                      [this](Time, const submap_poses_t& message) { OnSubmapPoses(message); });
  endpoint_.Subscribe(outputs::kGraph, [this](Time, const graph_t& message) {
    graph_version_ = message.version;
    model_.OnGraph(message);
  });
  endpoint_.Subscribe(outputs::kPose, [this](Time now, const pose_estimate_t& message) {
    OnEstimate(now, message);
  });
  endpoint_.Subscribe(outputs::kPlan,
                      [this](Time now, const plan_t& message) { model_.OnPlan(now, message); });
  endpoint_.Subscribe(outputs::kMissionStatus,
                      [this](Time, const mission_status_t& message) { model_.OnMission(message); });
  endpoint_.Subscribe(outputs::kStatus,
                      [this](Time, const status_t& message) { model_.OnStatus(message); });
  // The page does not show the others.
  ForEachChannel([this](const auto& channel) {
    if (!endpoint_.IsSubscribedTo(channel.name))
      endpoint_.Subscribe(channel, [](Time, const auto&) {});
  });
}

void ViewerNode::PassOn(Time now, const std::string& channel, const std::string& sender,
                        Bytes bytes) {
  if (settings_.view.source == ViewSource::kLive) {
    converter_.Add(now, channel, bytes);
  } else {
    HeardInLog& newest = of_log_[{channel, sender}];
    newest.number = ++heard_in_log_;
    newest.time = now;
    newest.bytes.assign(bytes.begin(), bytes.end());
  }
  if (new_submap_) converter_.AddSubmap(now, *std::exchange(new_submap_, nullptr));
}

void ViewerNode::EndLog() {
  std::map<std::int64_t, std::pair<std::string, HeardInLog>> in_order;
  for (auto& [key, heard] : of_log_) in_order[heard.number] = {key.first, std::move(heard)};
  of_log_.clear();
  for (const auto& [number, entry] : in_order)
    converter_.Add(entry.second.time, entry.first, entry.second.bytes);
}

void ViewerNode::ShowMap(const std::vector<SubmapPtr>& submaps, const submap_poses_t& places,
                         const graph_t& graph) {
  const Time time = TimeOf(places.header);
  for (const SubmapPtr& submap : submaps) {
    model_.OnSubmap(submap);
    converter_.AddSubmap(time, *submap);
  }
  OnSubmapPoses(places);
  model_.OnGraph(graph);
  converter_.Add(time, outputs::kSubmapPoses.name, Encode(places));
  converter_.Add(time, outputs::kGraph.name, Encode(graph));
}

void ViewerNode::OnSubmapPoses(const submap_poses_t& message) {
  const auto places = FromMessage(message);
  if (!places) {
    endpoint_.NoteMalformed();
    return;
  }
  poses_version_ = message.version;
  model_.OnPlaces(TimeOf(message.header), message.version, *places);
}

void ViewerNode::OnEstimate(Time now, const pose_estimate_t& message) {
  const auto X_WB = FromMessage(message.X_WB), X_WO = FromMessage(message.X_WO);
  const auto covariance_WB = FromMessage(message.covariance_WB);
  if (!X_WB || !X_WO || !covariance_WB) {
    endpoint_.NoteMalformed();
    return;
  }
  pose_version_ = message.version;
  model_.OnEstimate(now,
                    {TimeOf(message.header), *X_WB, *covariance_WB,
                     Eigen::Map<const Vec3>(message.velocity_B_m_s).norm(), message.yaw_rate_rad_s},
                    *X_WO);
}

void ViewerNode::AskForMissingPoses(Time now) {
  if (pose_version_ != poses_version_ || poses_version_ != graph_version_)
    AskForPoses(endpoint_, now);
}

void ViewerNode::Step(Time now) {
  now_ = now;
  model_.UpdateFrontiers(kFrontierBlocks);
  server_.Poll();
}

Frame ViewerNode::Refuse(const std::string& why) {
  ++refused_;
  return TextFrame(json({{"k", "refused"}, {"why", why}}).dump());
}

std::vector<Frame> ViewerNode::StateAt(double utime_us) const {
  std::vector<Frame> frames = {TextFrame(json({{"k", "at_begin"}, {"t", utime_us}}).dump())};
  for (Frame& frame : model_.history().At(static_cast<std::int64_t>(utime_us)))
    frames.push_back(std::move(frame));
  frames.push_back(TextFrame(json({{"k", "at_end"}, {"t", utime_us}}).dump()));
  return frames;
}

Frame ViewerNode::Order(const std::string& command) {
  if (!settings_.viewer.operators) return Refuse("commands are not allowed here");
  if (std::find(kCommands.begin(), kCommands.end(), command) == kCommands.end())
    return Refuse("there is no such command");
  operator_command_t message{};
  message.command = command;
  endpoint_.Publish(outputs::kOperator, message, now_);
  return TextFrame(json({{"k", "obeyed"}, {"command", command}}).dump());
}

std::vector<Frame> ViewerNode::OnRequest(const std::string& text) {
  const json request = json::parse(text, nullptr, false);
  const auto has = [&](const char* key, auto is_right) {
    const auto found = request.find(key);
    return found != request.end() && is_right(*found);
  };
  const auto is_text = [](const json& value) { return value.is_string(); };
  const auto is_number = [](const json& value) { return value.is_number(); };
  const std::string kind = has("k", is_text) ? request["k"].get<std::string>() : "";
  if (kind == "at" && has("t", is_number))
    return StateAt(std::clamp(request["t"].get<double>(), 0.0, kLatest_us));
  if (kind == "command" && has("command", is_text))
    return {Order(request["command"].get<std::string>())};
  return {Refuse("not understood")};
}

}  // namespace vog
