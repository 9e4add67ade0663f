#include "procs/map_service/map_service_node.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lib/base/files.h"
#include "lib/base/log.h"
#include "lib/bus/lcm_bus.h"
#include "lib/messages/submap_receiver.h"
#include "lib/submap/octree_file.h"
#include "procs/map_service/earlier_map.h"
#include "procs/map_service/map_answers.h"

namespace vog {
namespace {

// MISSION_STATUS.end_reason when the mission has all the submaps it may have.
constexpr const char* kBudgetUsed = "max_submaps";

/// Check sum of all that a submap says, the same when it comes back from a map folder: the last
/// bits of its quaternions may not.
std::uint32_t VersionOf(submap_t message) {
  for (pose_t* pose : {&message.base.odometry.X_OB, &message.base.edge_X_PM, &message.X_ML})
    for (double& number : pose->quaternion_wxyz) number = std::round(number * 1e9) + 0.0;
  return ContentChecksum(message);
}

/// Takes over the map of earlier flights, if any, where this one has none yet, and gives the
/// settings back: it comes before all else that a node is made of, so that a map that is refused
/// leaves no folder behind. A process that is killed meanwhile does it again.
MapServiceSettings WithEarlierMap(const MapServiceSettings& settings) {
  const MapOptions& options = settings.map;
  if (options.resume.empty() || IsMapFolder(options.directory)) return settings;
  StoredMap map =
      LoadEarlierMap(options.resume, settings.mission, settings.submap, settings.sensor_model);
  PutInPlaceOf(map, settings.put_in);  // Throws where that is not known.
  if (!map.end)
    LogLine(options.resume +
            ": does not tell where its mission ended; the place of its last scan is taken");
  map.run_id = settings.run_id;
  map.complete = false;
  map.put_in.reset();
  SaveMapFolder(map, options.directory);
  return settings;
}

}  // namespace

MapServiceSettings MapServiceSettings::From(const Config& config) {
  return {config.Read<MissionOptions>("mission"), config.Read<MapOptions>("map"),
          config.Read<PutInOptions>("put_in"),    config.Read<FuseOptions>("fuse"),
          config.Read<SubmapOptions>("submap"),   config.Read<SensorModelOptions>("sensor_model"),
          config.Read<DriftOptions>("drift"),     config.Read<BusOptions>("bus").run_id};
}

MapServiceNode::MapServiceNode(Bus& bus, const MapServiceSettings& settings)
    : settings_(WithEarlierMap(settings)),
      endpoint_(bus, "vog-map-service", settings.run_id),
      builder_(settings.submap, settings.sensor_model, settings.drift),
      map_(settings.submap.voxel_size_m, SensorModel(settings.sensor_model)),
      submaps_(map_, settings.fuse, SensorModel(settings.sensor_model)),
      writer_(settings.map.directory) {
  Resume();
  endpoint_.Subscribe(outputs::kScan, [this](Time, const scan_t& message) { OnScan(message); });
  endpoint_.Subscribe(outputs::kNav, [this](Time, const nav_t& message) { OnNav(message); });
  endpoint_.Subscribe(outputs::kSubmapPoses,
                      [this](Time, const submap_poses_t& message) { OnSubmapPoses(message); });
  endpoint_.Subscribe(outputs::kGraph, [this](Time, const graph_t& message) { OnGraph(message); });
  endpoint_.Subscribe(outputs::kMissionStatus,
                      [this](Time, const mission_status_t& message) { OnMissionStatus(message); });
  endpoint_.Subscribe(outputs::kMapRequest,
                      [this](Time, const map_request_t& request) { OnRequest(request); });
  bus.Every(std::chrono::seconds(1), [this](Time) {
    PublishStatus(newest_);
    // SLAM may have told them before this process began, or the disk was full then.
    if (is_finished_ && !is_complete_) AskForPoses(endpoint_, newest_);
  });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["submaps"] = submaps_.size();
    counters["map_digest"] = digest_;
    counters["poses_version"] = poses_version_;
    counters["fused"] = submaps_.fused();
    counters["scans_dropped"] = synchronizer_.dropped();
    counters["leaps"] = leaps_;
    counters["scans_waiting"] = synchronizer_.waiting();
    return save_fault_.empty() ? "ok" : save_fault_;
  });
}

void MapServiceNode::Resume() {
  if (!IsMapFolder(settings_.map.directory)) return;
  LoadedMap loaded = LoadMapFolder(settings_.map.directory);
  if (settings_.run_id != 0 && loaded.map.run_id != settings_.run_id)
    throw UsageError(settings_.map.directory +
                     ": holds the map of another run; move it away or choose another "
                     "map.directory");
  if (settings_.run_id == 0 && loaded.map.complete)
    throw UsageError(settings_.map.directory +
                     ": holds a finished map; move it away or choose another map.directory");
  if (loaded.map.voxel_size_m != settings_.submap.voxel_size_m)
    throw UsageError(settings_.map.directory +
                     ": holds a map of another submap.voxel_size_m; choose another map.directory");
  for (const std::string& fault : loaded.faults) LogLine(fault);
  StoredMap& map = loaded.map;
  std::size_t whole = 0;
  // Numbers without a gap: what comes behind a damaged submap cannot be joined to the rest.
  while (whole < map.submaps.size() && map.submaps[whole]->id() == static_cast<SubmapId>(whole))
    ++whole;
  if (whole < map.submaps.size()) {
    LogLine(settings_.map.directory + ": going on after submap " + std::to_string(whole - 1));
    map.submaps.resize(whole);
    map.end.reset();
    if (!settings_.map.resume.empty() && !map.put_in)
      throw UsageError(settings_.map.directory +
                       ": damaged before the flight began; remove it, it is copied again");
  }
  for (const SubmapPtr& submap : map.submaps) {
    const std::string octree_bytes = ToOctreeBytes(submap->grid);
    digest_ = AppendToDigest(digest_, VersionOf(ToMessage(*submap, octree_bytes)));
    writer_.AddSubmap(*submap, octree_bytes);
    submaps_.Place(submap, map.X_WM.at(submap->id()));
  }
  if (!map.submaps.empty()) JoinTo(map);
  is_complete_ = is_finished_ = map.complete;
}

void MapServiceNode::JoinTo(const StoredMap& map) {
  const Submap& last = *map.submaps.back();
  const SubmapId next = last.id() + 1;
  const bool is_later_flight = map.put_in || !settings_.map.resume.empty();
  end_ = map.end;
  // What it hangs on may have been lost to damage.
  if (map.put_in && map.put_in->id <= next) put_in_ = map.put_in;
  first_ = put_in_ ? put_in_->id : is_later_flight ? next : 0;
  if (put_in_ && put_in_->id == next) {
    builder_.ContinueFlight(*put_in_);
  } else if (is_later_flight && !map.put_in) {
    builder_.BeginFlight(last, PutInPlaceOf(map, settings_.put_in));
  } else {
    builder_.ContinueAfter(last);
  }
}

void MapServiceNode::OnScan(const scan_t& message) {
  auto scan = FromMessage(message);
  if (!scan) {
    endpoint_.NoteMalformed();
    return;
  }
  synchronizer_.Add(std::move(*scan));
  AddScans();
}

void MapServiceNode::OnNav(const nav_t& message) {
  const auto sample = FromMessage(message);
  if (!sample) {
    endpoint_.NoteMalformed();
    return;
  }
  newest_ = std::max(newest_, sample->time);
  newest_odometry_ = *sample;
  synchronizer_.Add(*sample);
  AddScans();
}

void MapServiceNode::AddScans() {
  while (const auto registered = synchronizer_.Next()) {
    // A planner that is behind, or dead, learns of the used budget later.
    if (is_finished_ || IsBudgetUsed()) continue;
    if (const SubmapPtr closed = Add(*registered)) OnClosed(closed, newest_);
    ShowOpen();
  }
}

SubmapPtr MapServiceNode::Add(const RegisteredScan& registered) {
  try {
    return builder_.Add(registered);
  } catch (const std::length_error&) {
    // The odometry has leapt farther than a submap can be wide; the next scan begins a new one.
    ++leaps_;
    return builder_.Close();
  }
}

void MapServiceNode::ShowOpen() {
  const Submap* open = builder_.open();
  if (open == nullptr) {
    map_.SetOpen(nullptr, Pose3::Identity());
    return;
  }
  if (told_open_ == open->id()) {
    map_.NoteOpenGrew();
    return;
  }
  const OdometryEdge& edge = open->base.edge;
  map_.SetOpen(&open->grid, submaps_.Has(open->id() - 1) ? submaps_.X_WM(open->id() - 1) * edge.X_PM
                                                         : open->base.odometry.X_OB);
  told_open_ = open->id();
  if (first_ > 0 && open->id() == first_ && !put_in_) NotePutIn(open->base);
  PublishStatus(newest_);
}

void MapServiceNode::NotePutIn(const SubmapBase& first) {
  put_in_ = first;
  end_ = PlaceInMap{first.odometry.time, first.edge.X_PM, PlanarOf(first.edge.covariance)};
  Save(/*complete=*/false);
}

void MapServiceNode::OnClosed(const SubmapPtr& submap, Time time) {
  map_.SetOpen(nullptr, Pose3::Identity());
  submaps_.Place(submap, submaps_.Has(submap->id() - 1)
                             ? submaps_.X_WM(submap->id() - 1) * submap->base.edge.X_PM
                             : submap->base.odometry.X_OB);
  const std::string octree_bytes = ToOctreeBytes(submap->grid);
  unsaved_[submap->id()] = octree_bytes;
  end_.reset();  // It was told by the submap before.
  Save(/*complete=*/false);
  const submap_t message = ToMessage(*submap, octree_bytes);
  digest_ = AppendToDigest(digest_, VersionOf(message));
  PublishSubmap(message, time);
  PublishStatus(time);
}

void MapServiceNode::OnSubmapPoses(const submap_poses_t& message) {
  const bool is_newer = message.header.epoch != poses_epoch_ || message.version > poses_version_;
  if (!is_newer) return;
  const auto places = FromMessage(message);
  if (!places) {
    endpoint_.NoteMalformed();
    return;
  }
  std::map<SubmapId, Pose3> X_WM;
  std::vector<std::pair<SubmapId, double>> sigmas_m;
  for (const SubmapPlace& place : *places) {
    X_WM[place.id] = place.X_WM;
    sigmas_m.emplace_back(place.id, HorizontalSigma(place.covariance_MN));
  }
  poses_epoch_ = message.header.epoch;
  poses_version_ = message.version;
  posed_submaps_ = message.count;
  submaps_.Move(X_WM, sigmas_m);
}

void MapServiceNode::OnGraph(const graph_t& message) {
  if (message.header.epoch != poses_epoch_ || message.version != poses_version_) return;
  graph_ = message;
  CompleteIfDone(newest_);
}

void MapServiceNode::OnMissionStatus(const mission_status_t& message) {
  if (message.state != "finished" || is_finished_) return;
  is_finished_ = true;
  // What was seen beyond the budget does not belong to the mission.
  if (message.end_reason == kBudgetUsed) builder_.Drop();
  if (const SubmapPtr last = builder_.Close()) OnClosed(last, newest_);
  ShowOpen();
  CompleteIfDone(newest_);
}

void MapServiceNode::CompleteIfDone(Time time) {
  if (!is_finished_ || is_complete_ || posed_submaps_ < submaps_.size() ||
      graph_.version != poses_version_)
    return;
  if (newest_odometry_ && builder_.HasLast()) {
    const OdometryEdge motion = builder_.EdgeTo(*newest_odometry_);
    end_ = PlaceInMap{newest_odometry_->time, motion.X_PM, PlanarOf(motion.covariance)};
  }
  Save(/*complete=*/true);
  is_complete_ = save_fault_.empty();
  PublishStatus(time);
}

G2oGraph MapServiceNode::Graph() const {
  G2oGraph graph;
  for (const SubmapId id : submaps_.ids()) graph.vertices[id] = submaps_.X_WM(id);
  if (!graph.vertices.empty()) graph.fixed = {graph.vertices.begin()->first};
  int newest_in_graph = -1;
  for (const graph_edge_t& edge : graph_.edge) {
    const auto X_ik = FromMessage(edge.X_ik);
    if (edge.kind == graph_edge_t::REJECTED_CLOSURE || !X_ik || !submaps_.Has(edge.from_id) ||
        !submaps_.Has(edge.to_id))
      continue;
    graph.edges.push_back({edge.from_id, edge.to_id, *X_ik, MatrixFrom<6>(edge.information)});
    newest_in_graph = std::max(newest_in_graph, edge.to_id);
  }
  // Submaps that SLAM has not answered for yet hang on their odometry.
  for (SubmapId id = std::max(1, newest_in_graph + 1); id < submaps_.size(); ++id) {
    const OdometryEdge& edge = submaps_.outline(id)->base.edge;
    graph.edges.push_back({id - 1, id, edge.X_PM, edge.covariance.inverse()});
  }
  return graph;
}

void MapServiceNode::Save(bool complete) {
  StoredMap map{settings_.submap.voxel_size_m,
                settings_.sensor_model,
                endpoint_.run_id(),
                complete,
                {},
                {},
                ToG2oText(Graph()),
                end_,
                put_in_};
  for (const SubmapId id : submaps_.ids()) {
    map.submaps.push_back(submaps_.outline(id));
    map.X_WM[id] = submaps_.X_WM(id);
  }
  try {
    while (!unsaved_.empty()) {
      const auto& [id, octree_bytes] = *unsaved_.begin();
      writer_.AddSubmap(*submaps_.outline(id), octree_bytes);
      unsaved_.erase(unsaved_.begin());
    }
    writer_.Commit(map);
    save_fault_.clear();
  } catch (const SystemError& error) {
    // The map goes on in memory; the next submap tries again.
    if (save_fault_.empty()) LogLine(error.what());
    save_fault_ = error.what();
  }
}

void MapServiceNode::PublishSubmap(const submap_t& message, Time time) {
  endpoint_.PublishLarge(outputs::kSubmap, message.base.submap_id, VersionOf(message), message,
                         time);
}

void MapServiceNode::PublishStatus(Time time) {
  map_status_t status{};
  status.submaps = submaps_.size();
  status.first = first_;
  status.digest = digest_;
  const Submap* open = builder_.open();
  status.has_open = open != nullptr;
  status.open = ToMessage(open != nullptr ? open->base : SubmapBase{});
  status.poses_version = poses_version_;
  status.complete = is_complete_;
  status.fault = save_fault_;
  endpoint_.Publish(outputs::kMapStatus, status, time);
}

void MapServiceNode::OnRequest(const map_request_t& request) {
  if (request.kind == "poses") return;  // SLAM answers.
  if (request.kind == "submaps") {
    for (const SubmapId id : request.ids == 0 ? submaps_.ids() : request.submap_id) {
      if (!submaps_.Has(id)) continue;
      const SubmapPtr submap = submaps_.submap(id);
      PublishSubmap(ToMessage(*submap, ToOctreeBytes(submap->grid)), newest_);
    }
    return;
  }
  map_reply_t reply = AnswerTo(request, map_);
  reply.poses_version = poses_version_;
  endpoint_.PublishLarge(outputs::kMapReply, request.request_id, 0, reply, newest_);
}

}  // namespace vog
