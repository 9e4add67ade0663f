#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lib/submap/sensor_model.h"
#include "lib/vogmap/vog_map.h"
#include "procs/viewer/board.h"
#include "procs/viewer/frames.h"
#include "procs/viewer/frontier_blocks.h"
#include "procs/viewer/history.h"
#include "procs/viewer/trail.h"
#include "vog/map_status_t.hpp"
#include "vog/mission_status_t.hpp"
#include "vog/pose_estimate_t.hpp"
#include "vog/status_t.hpp"
#include "vog/truth_t.hpp"

namespace vog {

/// What is shown.
enum class ViewSource { kLive, kLog, kMap };

/// What the page is told of the mission's settings.
struct ViewSettings {
  std::string name = "mission";
  ViewSource source = ViewSource::kLive;
  double voxel_size_m = 0.095;
  SensorModelOptions sensor_model;
  std::optional<Eigen::AlignedBox3d> exploration_W;
  std::vector<Eigen::AlignedBox3d> keep_out_W;
  int max_submaps = 0;  ///< 0 where nobody knows.
};

/// What a page shows of a run, made from its messages: each handler turns what it is told into
/// frames, posts them on the board and keeps the small ones for the time slider. Results do not
/// depend on who looks.
class ViewModel {
 public:
  ViewModel(const ViewSettings& settings, std::size_t history_bytes);
  ViewModel(const ViewModel&) = delete;
  ViewModel& operator=(const ViewModel&) = delete;

  void OnSubmap(const SubmapPtr& submap);
  /// All submaps are void; they come again.
  void OnSubmapsReset();
  void OnPlaces(Time time, std::int64_t version, const std::vector<SubmapPlace>& places);
  void OnGraph(const graph_t& graph);
  void OnOdometry(const OdometrySample& sample);
  void OnTruth(Time time, const Pose3& X_WB);
  /// `now` is when it was heard, as for a plan. X_WO of the same estimate.
  void OnEstimate(Time now, const ViewedEstimate& estimate, const Pose3& X_WO);
  void OnScan(const Scan& scan);
  void OnPlan(Time now, const plan_t& plan);
  void OnMission(const mission_status_t& status);
  void OnMap(const map_status_t& status);
  void OnStatus(const status_t& status);

  /// How far a log is read, 0 .. 1.
  void SetLoaded(double share);

  /// Brings up to `max_blocks` blocks of frontiers up to date.
  void UpdateFrontiers(int max_blocks);

  /// Whether there is nothing to do for UpdateFrontiers().
  bool IsUpToDate() const { return map_.HasAllFrontiers(); }

  const Board& board() const { return board_; }
  const History& history() const { return history_; }
  std::size_t submaps() const { return map_.submap_count(); }

 private:
  /// The VOG-map with the newest poses, and its frontiers.
  class Map {
   public:
    explicit Map(const ViewSettings& settings);
    void Place(const SubmapPtr& submap);
    void Move(const std::vector<SubmapPlace>& places);
    void Clear();
    std::vector<FrontierBlocks::Block> UpdateFrontiers(int max_blocks);
    bool HasAllFrontiers() const { return !frontiers_ || frontiers_->IsUpToDate(); }
    std::size_t submap_count() const { return static_cast<std::size_t>(map_.size()); }
    const VoxelGrid& grid() const { return map_.grid(); }

   private:
    VogMap map_;
    std::map<SubmapId, Pose3> X_WM_;
    std::optional<FrontierBlocks> frontiers_;
  };
  enum TrailNumber { kEstimateTrail, kOdometryTrail, kTruthTrail };
  static constexpr int kTrails = 3;
  struct Sample;

  void PostHello();
  void PostPlaces();
  void PostMission(Time time);
  /// Posts a frame of which only the newest counts, and remembers it.
  void PostNow(FrameKind kind, Time time, Frame frame);
  void AddToTrail(TrailNumber trail, const TrailPoint& point, const Vec3& position_W_m);
  void SampleSeries(Time time);
  std::optional<Vec3> TruthAt(Time time) const;

  ViewSettings settings_;
  LogOddsUnits occupied_from_;
  Board board_;
  History history_;
  Map map_;

  Time places_time_;
  std::int64_t places_version_ = 0;
  std::vector<SubmapPlace> places_;
  std::map<SubmapId, Time> first_scan_;     // Of each submap.
  std::map<SubmapId, Vec3> true_base_W_m_;  // Where each submap truly began.

  std::deque<std::pair<Time, Vec3>> truth_;  // The newest true positions.
  std::optional<ViewedEstimate> estimate_;
  std::optional<OdometrySample> odometry_;
  std::map<std::int64_t, Pose3> X_WO_;  // Where each of the odometry's worlds was at its start.
  std::map<Time, Time> heard_;          // When the newest estimates were heard, by their time.
  std::optional<double> planning_s_;
  std::optional<std::pair<std::int64_t, std::int64_t>> plan_;  // Epoch and number.

  std::optional<mission_status_t> mission_;
  std::optional<map_status_t> map_status_;
  std::map<std::string, status_t> status_;
  Time health_time_;
  int closures_[4] = {0, 0, 0, 0};  // By kind of edge.

  std::vector<Trail> trails_ = std::vector<Trail>(kTrails);
  std::string series_;  // The samples of the newest part, JSON without its brackets.
  int series_part_ = 0, series_samples_ = 0;
  std::optional<Time> sampled_;
};

}  // namespace vog
