#include "tools/mission/lock_step.h"

#include <chrono>

#include "lib/messages/endpoint.h"
#include "procs/controller/controller_node.h"
#include "procs/map_service/map_service_node.h"
#include "procs/nav_bridge/nav_bridge_node.h"
#include "procs/planner/planner_node.h"
#include "procs/slam/slam_node.h"
#include "procs/sonar_reader/sonar_reader_node.h"
#include "sim/world/world_options.h"

namespace vog {
namespace {

MapServiceSettings MapSettings(const Config& config, const MapPlaces& places) {
  MapServiceSettings settings = MapServiceSettings::From(config);
  settings.map.directory = places.directory;
  settings.map.resume = places.resume;
  return settings;
}

}  // namespace

void LatencyOptions::Visit(OptionsVisitor& v) {
  const auto visit = [&](const char* key, double& field) {
    v(key, field, Between(0, 60), "modelled time that the process's work takes, in lock step");
  };
  visit("nav_bridge_s", nav_bridge_s);
  visit("sonar_reader_s", sonar_reader_s);
  visit("map_service_s", map_service_s);
  visit("slam_s", slam_s);
  visit("planner_s", planner_s);
  visit("controller_s", controller_s);
}

void ProgressWatcher::OnMessage(Time time, const std::string& channel, Bytes bytes) {
  if (!begin_) begin_ = time;
  progress_.vehicle_time_s = ToSeconds(time - *begin_);
  HandleIf(channel, bytes, outputs::kMapStatus, [&](const map_status_t& status) {
    progress_.submaps = status.submaps;
    progress_.is_complete = status.complete;
    progress_.map_fault = status.fault;
    progress_.run_id = status.header.run_id;
  });
  HandleIf(channel, bytes, outputs::kGraph, [&](const graph_t& graph) {
    progress_.closures = 0;
    for (const graph_edge_t& edge : graph.edge)
      progress_.closures +=
          edge.kind == graph_edge_t::FULL_CLOSURE || edge.kind == graph_edge_t::PARTIAL_CLOSURE;
  });
  HandleIf(channel, bytes, outputs::kMissionStatus, [&](const mission_status_t& status) {
    progress_.state = status.state;
    progress_.end_reason = status.end_reason;
    progress_.explored_m3 = status.explored_m3;
  });
}

struct LockStepSystem::Nodes {
  Nodes(QueueBus& bus, const Config& config, const MapPlaces& places, const LatencyOptions& latency)
      : nav_bridge(bus.AddNode("vog-nav-bridge", FromSeconds(latency.nav_bridge_s)),
                   NavBridgeSettings::From(config)),
        sonar_reader(bus.AddNode("vog-sonar-reader", FromSeconds(latency.sonar_reader_s)),
                     SonarReaderSettings::From(config)),
        map_service(bus.AddNode("vog-map-service", FromSeconds(latency.map_service_s)),
                    MapSettings(config, places)),
        slam(bus.AddNode("vog-slam", FromSeconds(latency.slam_s)), SlamNodeSettings::From(config)),
        planner(bus.AddNode("vog-planner", FromSeconds(latency.planner_s)),
                PlannerSettings::From(config)),
        controller(bus.AddNode("vog-controller", FromSeconds(latency.controller_s)),
                   ControllerSettings::From(config)) {}

  NavBridgeNode nav_bridge;
  SonarReaderNode sonar_reader;
  MapServiceNode map_service;
  SlamNode slam;
  PlannerNode planner;
  ControllerNode controller;
};

LockStepSystem::LockStepSystem(const Config& config, const MapPlaces& places,
                               QueueBus::Observer observer)
    : bus_(config.Read<WorldOptions>("simulation").start()) {
  bus_.Observe(
      [this, observer = std::move(observer)](Time time, const std::string& channel, Bytes bytes) {
        watcher_.OnMessage(time, channel, bytes);
        observer(time, channel, bytes);
      });
  bus_.ObserveHandled([this](const QueueBus::Handled& handled) { OnHandled(handled); });
  nodes_ = std::make_unique<Nodes>(bus_, config, places, config.Read<LatencyOptions>("latency"));
}

LockStepSystem::~LockStepSystem() = default;

void LockStepSystem::OnHandled(const QueueBus::Handled& handled) {
  timing_.node_wall_s[handled.node] += handled.wall_s;
  if (handled.node != "vog-planner" || handled.channel != outputs::kPose.name) return;
  for (const std::string& channel : handled.published) {
    if (channel == outputs::kPlan.name)
      timing_.planning.push_back({progress().submaps, handled.wall_s});
  }
}

}  // namespace vog
