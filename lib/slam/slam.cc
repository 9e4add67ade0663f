#include "lib/slam/slam.h"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.h"

namespace vog {
namespace {

/// Used where the graph cannot tell its own uncertainty: no closure is refused for its place.
const Mat6 kNoPrediction = 1e6 * Mat6::Identity();
/// Added to each edge's covariance: without any drift it would have no inverse.
const Mat6 kLeastCovariance = 1e-12 * Mat6::Identity();

}  // namespace

SlamSettings SlamSettings::From(const Config& config) {
  return {config.Read<SlamOptions>("slam"), config.Read<LoopClosureOptions>("loop_closure"),
          config.Read<IcpOptions>("registration"), config.Read<PoseGraphOptions>("pose_graph"),
          config.Read<SensorModelOptions>("sensor_model")};
}

Slam::Slam(const SlamSettings& settings)
    : settings_(settings),
      occupied_from_(SensorModel(settings.sensor_model).occupied_from),
      graph_(settings.pose_graph) {}

Slam::~Slam() = default;

void Slam::AddSubmap(const SubmapPtr& submap) {
  AddNode(*submap);
  if (settings_.slam.loop_closures) {
    auto& shape = shapes_[submap->id()];
    shape = std::make_unique<SubmapShape>(submap, occupied_from_, settings_.loop_closure,
                                          settings_.registration);
    CloseLoops(*shape);
    graph_.Solve();
    if (DropContradicting()) graph_.Solve();
  }
  UpdateSigmas();
  ++version_;
}

void Slam::AddNode(const Submap& submap) {
  const OdometrySample& odometry = submap.base.odometry;
  const bool is_first = graph_.nodes().empty();
  const OdometryEdge& edge = submap.base.edge;
  graph_.AddNode(submap.id(), is_first ? odometry.X_OB : graph_.X_W(submap.id() - 1) * edge.X_PM);
  const RollPitchYaw angles = AnglesOf(odometry.X_OB);
  graph_.SetPrior(submap.id(),
                  {odometry.X_OB.translation().z(), angles.roll, angles.pitch,
                   settings_.slam.prior_sigma_z_m, settings_.slam.prior_sigma_angle_rad});
  if (!is_first)
    graph_.AddConstraint({submap.id() - 1, submap.id(), ConstraintKind::kOdometry, edge.X_PM,
                          WhiteningOf(edge.covariance + kLeastCovariance)});
}

void Slam::CloseLoops(const SubmapShape& source) {
  std::vector<const SubmapShape*> targets;
  std::vector<Pose3> X_ik;
  for (const auto& [id, shape] : shapes_) {
    if (id == source.id) continue;
    targets.push_back(shape.get());
    X_ik.push_back(Ominus(graph_.X_W(id), graph_.X_W(source.id)));
  }
  const auto candidates = FindCandidates(settings_.loop_closure, targets, source, X_ik);
  const auto covariances = PredictCovariances(candidates, source.id);
  std::vector<LoopClosure> loops(candidates.size());
  ParallelFor(candidates.size(), [&](std::size_t c) {
    const SubmapShape& target = *shapes_.at(candidates[c].id);
    loops[c] = CloseLoop(settings_.loop_closure, settings_.registration, target, source,
                         Ominus(graph_.X_W(target.id), graph_.X_W(source.id)), covariances[c]);
  });
  for (LoopClosure& loop : loops) {
    Closure closure{std::move(loop)};
    if (closure.loop.accepted) closure.constraint = graph_.AddConstraint(closure.loop.constraint);
    closures_.push_back(std::move(closure));
  }
}

std::vector<Mat6> Slam::PredictCovariances(const std::vector<LoopCandidate>& candidates,
                                           NodeId newest) const {
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (const LoopCandidate& candidate : candidates) pairs.emplace_back(candidate.id, newest);
  if (pairs.empty()) return {};
  const auto covariances = graph_.RelativeCovariances(pairs);
  return covariances.empty() ? std::vector<Mat6>(pairs.size(), kNoPrediction) : covariances;
}

bool Slam::DropContradicting() {
  bool dropped = false;
  for (Closure& closure : closures_) {
    if (!closure.loop.accepted) continue;
    closure.loop.chi_square = graph_.ChiSquareOf(closure.loop.constraint);
    if (closure.loop.chi_square <= ChiSquare99(closure.loop.directions)) continue;
    graph_.RemoveConstraint(closure.constraint);
    closure.constraint = -1;
    closure.loop.accepted = false;
    closure.loop.reason = "contradicts the other closures";
    dropped = true;
  }
  return dropped;
}

void Slam::UpdateSigmas() {
  const NodeId newest = graph_.nodes().rbegin()->first;
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (const auto& [id, X_W] : graph_.nodes()) pairs.emplace_back(id, newest);
  const auto covariances = graph_.RelativeCovariances(pairs);
  sigma_xy_m_.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double variance =
        covariances.empty() ? 1e6 : std::max(covariances[i](0, 0), covariances[i](1, 1));
    sigma_xy_m_[pairs[i].first] = std::sqrt(std::max(0.0, variance));
  }
}

}  // namespace vog
