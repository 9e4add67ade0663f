#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "lib/base/config.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "lib/planner/mission_options.h"
#include "lib/posegraph/g2o.h"
#include "lib/scan/scan_synchronizer.h"
#include "lib/submap/submap_builder.h"
#include "lib/vogmap/map_folder.h"
#include "lib/vogmap/map_options.h"
#include "lib/vogmap/submap_fuser.h"
#include "lib/vogmap/vog_map.h"

namespace vog {

struct MapServiceSettings {
  MissionOptions mission;
  MapOptions map;
  PutInOptions put_in;
  FuseOptions fuse;
  SubmapOptions submap;
  SensorModelOptions sensor_model;
  DriftOptions drift;
  std::int64_t run_id = 0;

  static MapServiceSettings From(const Config& config);
};

/// Builds submaps from scans, keeps the VOG-map at SLAM's newest poses, saves it, and answers
/// questions about it. Each closed submap is saved before it is told: who has heard of one can
/// always get it again. In: SCAN, NAV, SUBMAP_POSES, GRAPH, MAP_REQUEST, MISSION_STATUS. Out:
/// SUBMAP, MAP_STATUS, MAP_REPLY, MAP_REQUEST (poses), STATUS.
class MapServiceNode {
 public:
  /// Goes on with the map in the directory if it is of this run and not complete; where there is
  /// none, with a copy of map.resume's, if any. @throws UsageError when it is another run's, or the
  /// map of earlier flights cannot be gone on from.
  MapServiceNode(Bus& bus, const MapServiceSettings& settings);

 private:
  void Resume();
  /// Tells the builder what the next submap hangs on.
  void JoinTo(const StoredMap& map);
  bool IsBudgetUsed() const { return submaps_.size() >= settings_.mission.max_submaps; }
  void OnScan(const scan_t& message);
  void OnNav(const nav_t& message);
  void AddScans();
  SubmapPtr Add(const RegisteredScan& registered);
  void OnClosed(const SubmapPtr& submap, Time time);
  void OnSubmapPoses(const submap_poses_t& message);
  void OnGraph(const graph_t& message);
  void OnMissionStatus(const mission_status_t& message);
  void OnRequest(const map_request_t& request);
  void CompleteIfDone(Time time);
  void ShowOpen();
  /// Keeps how the flight began, for the case that its first submap is lost.
  void NotePutIn(const SubmapBase& first);
  void Save(bool complete);
  G2oGraph Graph() const;
  void PublishSubmap(const submap_t& message, Time time);
  void PublishStatus(Time time);

  MapServiceSettings settings_;
  Endpoint endpoint_;
  ScanSynchronizer synchronizer_;
  SubmapBuilder builder_;
  VogMap map_;
  SubmapFuser submaps_;  // Shown in map_.
  MapFolderWriter writer_;
  graph_t graph_{};
  std::int64_t digest_ = 0;
  std::int64_t poses_epoch_ = -1, poses_version_ = 0;
  int posed_submaps_ = 0;                    // With poses from SLAM.
  int told_open_ = -1;                       // Number of the open submap that was told last.
  std::map<SubmapId, std::string> unsaved_;  // Octree files that are not on disk yet.
  bool is_finished_ = false, is_complete_ = false;
  SubmapId first_ = 0;  // Of this flight.
  std::optional<SubmapBase> put_in_;
  std::optional<PlaceInMap> end_;  // Where the vehicle was last, by the last closed submap.
  std::optional<OdometrySample> newest_odometry_;
  std::int64_t leaps_ = 0;
  std::string save_fault_;
  Time newest_;
};

}  // namespace vog
