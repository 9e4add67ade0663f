#include "procs/slam/slam_node.h"

#include <algorithm>

#include "lib/bus/lcm_bus.h"
#include "lib/planner/mission_options.h"

namespace vog {
namespace {

graph_edge_t ToMessage(const Constraint& constraint) {
  graph_edge_t edge{};
  edge.from_id = constraint.from;
  edge.to_id = constraint.to;
  edge.kind = constraint.kind == ConstraintKind::kOdometry      ? graph_edge_t::ODOMETRY
              : constraint.kind == ConstraintKind::kFullClosure ? graph_edge_t::FULL_CLOSURE
                                                                : graph_edge_t::PARTIAL_CLOSURE;
  edge.X_ik = vog::ToMessage(constraint.X_ik);
  CopyMatrix<6>(constraint.Information(), edge.information);
  edge.directions = static_cast<std::int8_t>(constraint.whitening.rows());
  edge.chi_square = 0;
  return edge;
}

graph_t ToMessage(const Slam& slam) {
  graph_t message{};
  for (const auto& [number, constraint] : slam.graph().constraints()) {
    graph_edge_t edge = ToMessage(slam.BetweenBases(constraint));
    edge.chi_square = slam.graph().ChiSquareOf(constraint);
    message.edge.push_back(edge);
  }
  for (const Slam::Closure& closure : slam.closures()) {
    if (closure.loop.accepted) continue;
    graph_edge_t edge = ToMessage(slam.BetweenBases(closure.loop.constraint));
    edge.kind = graph_edge_t::REJECTED_CLOSURE;
    edge.chi_square = closure.loop.chi_square;
    edge.reason = closure.loop.reason;
    message.edge.push_back(edge);
  }
  message.count = static_cast<int>(message.edge.size());
  return message;
}

submap_poses_t PosesOf(const Slam& slam) {
  std::vector<SubmapPlace> places;
  for (const auto& [id, X_WM] : slam.X_WM()) {
    const PlaceCovariance& covariance = slam.covariances().at(id);
    places.push_back({id, X_WM, covariance.of_X_WM, covariance.of_X_MN});
  }
  return vog::ToMessage(places);
}

/// Of X_WB = X_WM * X_MB.
Mat6 Compose(const Mat6& covariance_WM, const Pose3& X_MB, const Mat6& covariance_MB) {
  const Mat6 Ad = AdjointOf(X_MB.inverse());
  return Ad * covariance_WM * Ad.transpose() + covariance_MB;
}

}  // namespace

SlamNodeSettings SlamNodeSettings::From(const Config& config) {
  SlamNodeSettings settings{SlamSettings::From(config), config.Read<SubmapOptions>("submap"),
                            config.Read<DriftOptions>("drift"),
                            config.Read<BusOptions>("bus").run_id};
  if (config.Read<MissionOptions>("mission").mode == MissionMode::kVogNoLc)
    settings.slam.slam.loop_closures = false;
  return settings;
}

SlamNode::SlamNode(Bus& bus, const SlamNodeSettings& settings)
    : settings_(settings),
      endpoint_(bus, "vog-slam", settings.run_id),
      slam_(std::make_unique<Slam>(settings.slam)),
      receiver_(endpoint_,
                {[this](const SubmapPtr& submap) { OnSubmap(submap); }, [this] { OnReset(); },
                 [this](const map_status_t& status) { OnMapStatus(status); }}) {
  endpoint_.Subscribe(outputs::kNav, [this](Time, const nav_t& message) { OnNav(message); });
  endpoint_.Subscribe(outputs::kMapRequest, [this](Time, const map_request_t& request) {
    if (request.kind == "poses" && version_ > 0) PublishSolution(newest_);
  });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["submaps"] = static_cast<std::int64_t>(odometry_.size());
    counters["map_digest"] = receiver_.digest();
    counters["poses_version"] = version_;
    counters["waiting"] = static_cast<std::int64_t>(waiting_.size());
    counters["chunks_dropped"] = receiver_.dropped();
    return receiver_.IsComplete() ? "ok" : "waiting for submaps";
  });
}

void SlamNode::OnReset() {
  slam_ = std::make_unique<Slam>(settings_.slam);
  waiting_.clear();
  odometry_.clear();
  revisits_ = {};
}

void SlamNode::OnSubmap(const SubmapPtr& submap) {
  waiting_[submap->id()] = submap;
  bool added = false;
  while (!waiting_.empty() && waiting_.begin()->first == static_cast<SubmapId>(odometry_.size())) {
    const SubmapPtr next = waiting_.extract(waiting_.begin()).mapped();
    slam_->AddSubmap(next);
    odometry_[next->id()] = next->base.odometry;
    newest_ = std::max(newest_, next->last_scan);
    const bool is_newer = !last_ || last_->odometry.time < next->last_scan;
    if (next->id() >= first_ && is_newer)
      last_ = Last{AnchorAt(next->id()), OdometryAtLastScan(*next)};
    added = true;
  }
  if (!added) return;
  ++version_;
  PublishSolution(newest_);
}

void SlamNode::PublishSolution(Time time) {
  submap_poses_t poses = PosesOf(*slam_);
  poses.version = version_;
  endpoint_.Publish(outputs::kSubmapPoses, poses, time);
  graph_t graph = ToMessage(*slam_);
  graph.version = version_;
  endpoint_.Publish(outputs::kGraph, graph, time);
  if (revisits_.version != version_) {
    revisits_ = vog::ToMessage(slam_->ExpectedRevisits());
    revisits_.version = version_;
  }
  endpoint_.Publish(outputs::kRevisits, revisits_, time);
}

void SlamNode::OnMapStatus(const map_status_t& status) {
  if (status.first != first_) last_.reset();
  first_ = status.first;
  open_.reset();
  if (!status.has_open) return;
  open_ = FromMessage(status.open);
  if (!open_) endpoint_.NoteMalformed();
}

SlamNode::Anchor SlamNode::AnchorAt(SubmapId id) const {
  return {odometry_.at(id), slam_->X_WM().at(id), slam_->covariances().at(id).of_X_WM,
          Mat3::Zero()};
}

SlamNode::Anchor SlamNode::Beyond(const Anchor& anchor, const OdometryEdge& edge,
                                  const OdometrySample& odometry) {
  return {odometry, anchor.X_WM * edge.X_PM,
          Compose(anchor.covariance_WM, edge.X_PM, edge.covariance),
          ComposePlanarCovariance(anchor.since, edge.X_PM, PlanarOf(edge.covariance))};
}

std::optional<SlamNode::Anchor> SlamNode::AnchorFor(const OdometrySample& sample) const {
  if (const auto base = BaseIn(sample.segment)) return base;
  return StandInFor(sample);
}

std::optional<SlamNode::Anchor> SlamNode::BaseIn(std::int64_t segment) const {
  const auto newest = odometry_.rbegin();
  if (newest != odometry_.rend() && newest->first >= first_ && newest->second.segment == segment)
    return AnchorAt(newest->first);
  if (!open_ || open_->odometry.segment != segment) return std::nullopt;
  if (open_->id == 0)
    return Anchor{open_->odometry, open_->odometry.X_OB, Mat6::Zero(), Mat3::Zero()};
  if (!odometry_.count(open_->id - 1)) return std::nullopt;
  return Beyond(AnchorAt(open_->id - 1), open_->edge, open_->odometry);
}

std::optional<SlamNode::Anchor> SlamNode::StandInFor(const OdometrySample& sample) const {
  if (!last_) return std::nullopt;
  const Anchor& old = last_->anchor;
  if (old.odometry.segment == sample.segment) return old;
  const OdometryEdge edge =
      MakeOdometryEdge(settings_.submap, settings_.drift, old.odometry, last_->odometry, sample);
  return Beyond(old, edge, sample);
}

void SlamNode::OnNav(const nav_t& message) {
  const auto sample = FromMessage(message);
  if (!sample) {
    endpoint_.NoteMalformed();
    return;
  }
  const auto anchor = AnchorFor(*sample);
  if (!anchor) return;
  last_ = Last{*anchor, *sample};
  const Pose3 X_WO = anchor->X_WM * anchor->odometry.X_OB.inverse();
  pose_estimate_t pose{};
  pose.version = version_;
  pose.X_WB = vog::ToMessage(Pose3(X_WO * sample->X_OB));
  pose.segment = sample->segment;
  pose.X_WO = vog::ToMessage(X_WO);
  const Mat3 moved = MotionCovariance(anchor->odometry, *sample);
  const Pose3 X_MB = Ominus(anchor->odometry.X_OB, sample->X_OB);
  CopyMatrix<3>(ComposePlanarCovariance(anchor->since, X_MB, moved), pose.covariance_xyyaw);
  pose.covariance_WB = vog::ToMessage(Compose(anchor->covariance_WM, X_MB, PlanarTo6(moved)));
  std::copy_n(message.velocity_B_m_s, 3, pose.velocity_B_m_s);
  pose.yaw_rate_rad_s = message.yaw_rate_rad_s;
  endpoint_.Publish(outputs::kPose, pose, sample->time);
}

}  // namespace vog
