#include "tools/view/view_log.h"

#include <Eigen/LU>
#include <cstdio>

#include "lib/base/log.h"
#include "lib/bus/lcm_log.h"
#include "lib/bus/process.h"
#include "lib/bus/queue_bus.h"
#include "lib/posegraph/g2o.h"
#include "lib/vogmap/map_folder.h"
#include "procs/viewer/viewer_node.h"
#include "tools/mission/replay.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

constexpr int kEventsAtOnce = 200;      // Between two looks at the pages.
constexpr int kEventsUntilRun = 10000;  // RUN stands at the head of a log.
constexpr Duration kWait = std::chrono::milliseconds(100);

/// The settings that a log tells of its run; without them there is no exploration box.
ViewSettings SettingsIn(const fs::path& log) {
  const auto run = FirstRun(log, kEventsUntilRun);
  if (!run) return {};
  return ViewerSettings::From(Config::Parse(run->config_toml, log.string() + ": RUN")).view;
}

void PrintUrl(const PageServer& server) {
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
}

/// Serves until the end, finding frontiers meanwhile.
void Serve(ViewerNode& node, const std::atomic<bool>& stop) {
  while (!stop) {
    node.Step(Time{});
    node.server().Wait(node.model().IsUpToDate() ? kWait : Duration::zero());
  }
}

void ServeLog(const fs::path& log, ViewerSettings settings) {
  settings.view = SettingsIn(log);
  settings.view.source = ViewSource::kLog;
  const std::atomic<bool>& stop = StopSignal();
  QueueBus queue;
  ViewerNode node(queue.AddNode("vog-viewer"), settings);
  PrintUrl(node.server());
  LcmLogReader reader(log.string());
  const double size = static_cast<double>(fs::file_size(log));
  double read = 0;
  node.model().SetLoaded(0);
  for (bool has_more = true; has_more && !stop;) {
    for (int i = 0; i < kEventsAtOnce; ++i) {
      const auto event = reader.Next();
      has_more = event.has_value();
      if (!has_more) break;
      read += static_cast<double>(event->bytes.size() + event->channel.size()) + 28;
      queue.PublishAt(std::max(event->time, queue.now()), event->channel, event->bytes);
      queue.RunUntil(std::max(event->time, queue.now()));
    }
    node.model().SetLoaded(std::min(1.0, read / size));
    node.server().Poll();
  }
  node.model().SetLoaded(1);
  node.EndLog();
  if (node.counts().malformed > 0)
    LogLine(std::to_string(node.counts().malformed) + " of " +
            std::to_string(node.counts().malformed + node.counts().received) +
            " messages were not understood: damaged, or of another version of Vogmap");
  Serve(node, stop);
}

/// The edges of a map's graph file. What its closures were is known by their information alone.
graph_t GraphOf(const StoredMap& map, Time time) {
  graph_t graph{};
  graph.header.utime_us = ToUtime(time);
  graph.version = 1;
  for (const G2oEdge& edge : ParseG2o(map.graph_g2o, "graph.g2o").graph.edges) {
    Eigen::FullPivLU<Mat6> decomposition(edge.information);
    decomposition.setThreshold(1e-9);
    const auto rank = decomposition.rank();
    graph_edge_t message{};
    message.from_id = edge.from;
    message.to_id = edge.to;
    message.kind = std::abs(edge.to - edge.from) == 1 ? graph_edge_t::ODOMETRY
                   : rank < 6                         ? graph_edge_t::PARTIAL_CLOSURE
                                                      : graph_edge_t::FULL_CLOSURE;
    message.directions = static_cast<std::int8_t>(rank);
    CopyMatrix<6>(edge.information, message.information);
    graph.edge.push_back(message);
  }
  graph.count = static_cast<int>(graph.edge.size());
  return graph;
}

/// A map without its run: submaps at their poses.
void ServeMap(const fs::path& folder, ViewerSettings settings) {
  const LoadedMap loaded = LoadMapFolder(folder);
  for (const std::string& fault : loaded.faults) LogLine(fault);
  settings.view.source = ViewSource::kMap;
  settings.view.name = fs::weakly_canonical(folder).filename().string();
  settings.view.voxel_size_m = loaded.map.voxel_size_m;
  settings.view.sensor_model = loaded.map.sensor_model;
  QueueBus queue;
  ViewerNode node(queue.AddNode("vog-viewer"), settings);
  PrintUrl(node.server());
  std::vector<SubmapPlace> places;
  Time newest{};
  for (const SubmapPtr& submap : loaded.map.submaps) {
    SubmapPlace place;
    place.id = submap->id();
    place.X_WM = loaded.map.X_WM.at(submap->id());
    places.push_back(place);
    newest = std::max(newest, submap->last_scan);
  }
  submap_poses_t message = ToMessage(places);
  message.header.utime_us = ToUtime(newest);
  message.version = 1;
  node.ShowMap(loaded.map.submaps, message, GraphOf(loaded.map, newest));
  Serve(node, StopSignal());
}

}  // namespace

void ServeRun(const fs::path& path, const ViewerOptions& options) {
  ViewerSettings settings;
  settings.viewer = options;
  if (!fs::is_directory(path)) return ServeLog(path, settings);
  if (fs::exists(path / "lcm.log")) return ServeLog(path / "lcm.log", settings);
  for (const fs::path& folder : {path, path / "map"})
    if (IsMapFolder(folder)) return ServeMap(folder, settings);
  throw UsageError(path.string() + " holds neither a run (lcm.log) nor a map (map.toml)");
}

}  // namespace vog
