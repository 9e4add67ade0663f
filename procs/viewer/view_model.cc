#include "procs/viewer/view_model.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace vog {
namespace {

using nlohmann::json;

constexpr std::size_t kTruthsKept = 3000;
constexpr std::size_t kHeardKept = 100;
constexpr Duration kSamplePeriod = std::chrono::seconds(1);
constexpr int kSeriesPart = 64;

std::string ToText(const json& object) {
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

json ToJson(const Eigen::AlignedBox3d& box) {
  return {{"min", {box.min().x(), box.min().y(), box.min().z()}},
          {"max", {box.max().x(), box.max().y(), box.max().z()}}};
}

const char* NameOf(ViewSource source) {
  switch (source) {
    case ViewSource::kLive:
      return "live";
    case ViewSource::kLog:
      return "log";
    case ViewSource::kMap:
      break;
  }
  return "map";
}

json ToJson(std::optional<double> number) { return number ? json(*number) : json(nullptr); }

json ToJson(const status_t& status) {
  json counters = json::object();
  for (const counter_t& counter : status.counter) counters[counter.name] = counter.value;
  return {{"name", status.process},
          {"health", status.health},
          {"t", status.header.utime_us},
          {"epoch", status.header.epoch},
          {"counters", counters}};
}

}  // namespace

ViewModel::Map::Map(const ViewSettings& settings)
    : map_(settings.voxel_size_m, SensorModel(settings.sensor_model)) {
  if (settings.exploration_W) frontiers_.emplace(map_, *settings.exploration_W);
}

void ViewModel::Map::Place(const SubmapPtr& submap) {
  // A map of other voxels than the settings tell cannot be summed; its submaps are shown all the
  // same.
  if (submap->grid.grid().voxel_size_m() != map_.grid().voxel_size_m()) return;
  const auto told = X_WM_.find(submap->id());
  map_.Place(submap, told != X_WM_.end() ? told->second : submap->base.odometry.X_OB);
}

void ViewModel::Map::Move(const std::vector<SubmapPlace>& places) {
  std::vector<std::pair<SubmapId, Pose3>> moves;
  for (const SubmapPlace& place : places) {
    const auto [known, is_new] = X_WM_.try_emplace(place.id, place.X_WM);
    if (!is_new && known->second.matrix() == place.X_WM.matrix()) continue;
    known->second = place.X_WM;
    moves.emplace_back(place.id, place.X_WM);
  }
  map_.Move(moves);
}

void ViewModel::Map::Clear() {
  for (const SubmapId id : map_.ids()) map_.Remove(id);
}

std::vector<FrontierBlocks::Block> ViewModel::Map::UpdateFrontiers(int max_blocks) {
  if (HasAllFrontiers()) return {};
  return frontiers_->Update(max_blocks);
}

ViewModel::ViewModel(const ViewSettings& settings, std::size_t history_bytes)
    : settings_(settings),
      occupied_from_(SensorModel(settings.sensor_model).occupied_from),
      history_(history_bytes),
      map_(settings) {
  PostHello();
}

void ViewModel::PostHello() {
  json boxes = json::array();
  if (settings_.exploration_W) {
    json box = ToJson(*settings_.exploration_W);
    box["kind"] = "exploration";
    boxes.push_back(box);
  }
  for (const Eigen::AlignedBox3d& keep_out_W : settings_.keep_out_W) {
    json box = ToJson(keep_out_W);
    box["kind"] = "keep_out";
    boxes.push_back(box);
  }
  board_.Post({FrameKind::kHello, 0}, TextFrame(ToText({{"k", "hello"},
                                                        {"version", VOG_VERSION},
                                                        {"name", settings_.name},
                                                        {"source", NameOf(settings_.source)},
                                                        {"voxel_m", settings_.voxel_size_m},
                                                        {"max_submaps", settings_.max_submaps},
                                                        {"boxes", boxes}})));
}

void ViewModel::PostNow(FrameKind kind, Time time, Frame frame) {
  history_.Add(kind, ToUtime(time), frame);
  board_.Post({kind, 0}, std::move(frame));
}

void ViewModel::SetLoaded(double share) {
  board_.Post({FrameKind::kLoading, 0}, TextFrame(ToText({{"k", "loading"}, {"share", share}})));
}

void ViewModel::OnSubmap(const SubmapPtr& submap) {
  first_scan_[submap->id()] = submap->first_scan;
  if (const auto truth = TruthAt(submap->first_scan)) true_base_W_m_[submap->id()] = *truth;
  map_.Place(submap);
  board_.Post({FrameKind::kSubmap, submap->id()},
              BinaryFrame(SubmapFrame(*submap, occupied_from_)));
}

void ViewModel::OnSubmapsReset() {
  map_.Clear();
  board_.Clear();
  PostHello();
  // What is said seldom, or was said in parts, must not be lost with the submaps.
  trails_ = std::vector<Trail>(kTrails);
  history_.Clear();
  series_.clear();
  series_samples_ = series_part_ = 0;
  places_.clear();
  true_base_W_m_.clear();
}

std::optional<Vec3> ViewModel::TruthAt(Time time) const {
  const auto after =
      std::lower_bound(truth_.begin(), truth_.end(), time,
                       [](const std::pair<Time, Vec3>& entry, Time t) { return entry.first < t; });
  if (after == truth_.end()) return std::nullopt;
  if (after->first == time) return after->second;
  if (after == truth_.begin()) return std::nullopt;
  const auto& [t0, p0] = *std::prev(after);
  const double share = ToSeconds(time - t0) / ToSeconds(after->first - t0);
  return Vec3(p0 + share * (after->second - p0));
}

void ViewModel::OnPlaces(Time time, std::int64_t version, const std::vector<SubmapPlace>& places) {
  places_time_ = time;
  places_version_ = version;
  places_ = places;
  map_.Move(places);
  PostPlaces();
}

void ViewModel::PostPlaces() {
  std::vector<ViewedPlace> viewed;
  for (const SubmapPlace& place : places_) {
    const auto truth = true_base_W_m_.find(place.id);
    viewed.push_back({place, std::nullopt});
    if (truth != true_base_W_m_.end())
      viewed.back().true_error_m = (place.X_WM.translation() - truth->second).norm();
  }
  PostNow(FrameKind::kPoses, places_time_,
          BinaryFrame(PosesFrame(places_time_, places_version_, viewed)));
}

void ViewModel::OnGraph(const graph_t& graph) {
  std::fill_n(closures_, 4, 0);
  for (const graph_edge_t& edge : graph.edge)
    if (edge.kind >= 0 && edge.kind < 4) ++closures_[edge.kind];
  PostNow(FrameKind::kGraph, TimeOf(graph.header), BinaryFrame(GraphFrame(graph)));
}

void ViewModel::AddToTrail(TrailNumber trail, const TrailPoint& point, const Vec3& position_W_m) {
  Trail& path = trails_[trail];
  if (!path.Add(point, position_W_m)) return;
  const int part = path.part_number();
  board_.Post({FrameKind::kTrail, std::int64_t{part} * kTrails + trail},
              BinaryFrame(TrailFrame(trail, part, path.part())));
}

void ViewModel::OnOdometry(const OdometrySample& sample) {
  odometry_ = sample;
  const auto origin = X_WO_.find(sample.origin);
  if (origin == X_WO_.end()) return;  // The estimate will tell where that world is.
  const Pose3 X_WB = origin->second * sample.X_OB;
  AddToTrail(kOdometryTrail, {sample.time, -1, X_WB.translation()}, X_WB.translation());
  PostNow(FrameKind::kOdometry, sample.time,
          BinaryFrame(BodyFrame(FrameKind::kOdometry, sample.time, X_WB)));
}

void ViewModel::OnTruth(Time time, const Pose3& X_WB) {
  if (!truth_.empty() && time <= truth_.back().first) return;
  truth_.emplace_back(time, X_WB.translation());
  if (truth_.size() > kTruthsKept) truth_.pop_front();
  AddToTrail(kTruthTrail, {time, -1, X_WB.translation()}, X_WB.translation());
  PostNow(FrameKind::kTruth, time, BinaryFrame(BodyFrame(FrameKind::kTruth, time, X_WB)));
}

void ViewModel::OnEstimate(Time now, const ViewedEstimate& estimate, const Pose3& X_WO) {
  estimate_ = estimate;
  if (odometry_) X_WO_.try_emplace(odometry_->origin, X_WO);
  heard_[estimate.time] = now;
  if (heard_.size() > kHeardKept) heard_.erase(heard_.begin());
  const Vec3 position_W = estimate.X_WB.translation();
  TrailPoint point{estimate.time, -1, position_W};
  if (!places_.empty()) {
    // The path hangs on the newest submap, and bends with the graph.
    const SubmapPlace& newest = places_.back();
    point.anchor = newest.id;
    point.position_m = newest.X_WM.inverse() * position_W;
  }
  AddToTrail(kEstimateTrail, point, position_W);
  PostNow(FrameKind::kEstimate, estimate.time, BinaryFrame(EstimateFrame(estimate)));
  SampleSeries(estimate.time);
}

void ViewModel::OnScan(const Scan& scan) {
  PostNow(FrameKind::kScan, scan.time, BinaryFrame(ScanFrame(scan)));
}

void ViewModel::OnPlan(Time now, const plan_t& plan) {
  const std::pair key(plan.header.epoch, plan.plan_id);
  if (plan_ == key) return;  // Told again for those who come late.
  plan_ = key;
  // From the estimate that it answers to its arrival.
  if (const auto heard = heard_.find(TimeOf(plan.header)); heard != heard_.end())
    planning_s_ = ToSeconds(now - heard->second);
  PostNow(FrameKind::kPlan, TimeOf(plan.header), TextFrame(PlanFrame(plan)));
}

void ViewModel::OnMission(const mission_status_t& status) {
  mission_ = status;
  PostMission(TimeOf(status.header));
}

void ViewModel::OnMap(const map_status_t& status) {
  map_status_ = status;
  PostMission(TimeOf(status.header));
}

void ViewModel::PostMission(Time time) {
  json object = {{"k", "mission"}, {"t", ToUtime(time)}};
  if (mission_)
    object.update({{"state", mission_->state},
                   {"hold", mission_->hold},
                   {"end_reason", mission_->end_reason},
                   {"home", mission_->is_home != 0},
                   {"unseen", {mission_->unseen_voxels, mission_->unseen_in_vain}},
                   {"refused", mission_->refused},
                   {"plans", mission_->plans},
                   {"explored_m3", mission_->explored_m3}});
  if (map_status_)
    object.update({{"submaps", map_status_->submaps},
                   {"complete", map_status_->complete != 0},
                   {"fault", map_status_->fault}});
  PostNow(FrameKind::kMission, time, TextFrame(ToText(object)));
}

void ViewModel::OnStatus(const status_t& status) {
  status_[status.process] = status;
  json processes = json::array();
  for (const auto& [name, said] : status_) processes.push_back(ToJson(said));
  const Time time = TimeOf(status.header);
  Frame frame =
      TextFrame(ToText({{"k", "health"}, {"t", ToUtime(time)}, {"processes", processes}}));
  // All say it once a second; one picture a second is enough to remember.
  if (time - health_time_ >= kSamplePeriod) {
    health_time_ = time;
    history_.Add(FrameKind::kHealth, ToUtime(time), frame);
  }
  board_.Post({FrameKind::kHealth, 0}, std::move(frame));
}

void ViewModel::SampleSeries(Time time) {
  if (sampled_ && time - *sampled_ < kSamplePeriod) return;
  sampled_ = time;
  const auto truth_W = TruthAt(time);
  const auto error_of = [&](const std::optional<Vec3>& position_W) -> std::optional<double> {
    if (!truth_W || !position_W) return std::nullopt;
    return (*position_W - *truth_W).norm();
  };
  std::optional<Vec3> odometry_W;
  if (odometry_ && X_WO_.count(odometry_->origin))
    odometry_W = X_WO_.at(odometry_->origin) * odometry_->X_OB.translation();
  const double variance = estimate_->covariance_WB.topLeftCorner<3, 3>().trace();
  const json sample = {
      ToUtime(time),
      ToJson(error_of(Vec3(estimate_->X_WB.translation()))),
      ToJson(error_of(odometry_W)),
      std::sqrt(std::max(0.0, variance)),
      ToJson(mission_ ? std::optional(mission_->explored_m3) : std::nullopt),
      ToJson(planning_s_),
      closures_[graph_edge_t::FULL_CLOSURE],
      closures_[graph_edge_t::PARTIAL_CLOSURE],
      closures_[graph_edge_t::REJECTED_CLOSURE],
      places_.size(),
  };
  if (series_samples_ == kSeriesPart) {
    series_.clear();
    series_samples_ = 0;
    ++series_part_;
  }
  series_ += (series_samples_++ > 0 ? "," : "") + sample.dump();
  board_.Post({FrameKind::kSeries, series_part_},
              TextFrame(R"({"k":"series","part":)" + std::to_string(series_part_) +
                        R"(,"samples":[)" + series_ + "]}"));
}

void ViewModel::UpdateFrontiers(int max_blocks) {
  for (const auto& [corner, frontiers] : map_.UpdateFrontiers(max_blocks)) {
    // A number of its own for each block, 20 bits a coordinate.
    const auto bits = [](std::int32_t index) {
      return static_cast<std::int64_t>(index / FrontierBlocks::kSide) & 0xfffff;
    };
    board_.Post(
        {FrameKind::kFrontier, bits(corner.x) << 40 | bits(corner.y) << 20 | bits(corner.z)},
        BinaryFrame(FrontierFrame(corner, settings_.voxel_size_m, frontiers)));
  }
}

}  // namespace vog
