#include "lib/slam/slam.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/base/chi_square.h"
#include "lib/base/parallel.h"
#include "lib/loopclosure/relocalisation.h"
#include "lib/slam/revisits.h"

namespace vog {
namespace {

/// Used where the graph cannot tell its own uncertainty: no closure is refused for its place.
const Mat6 kNoPrediction = 1e6 * Mat6::Identity();
/// Of a new submap: the second confirms the first.
constexpr int kEnoughFullClosures = 2;
/// Added to each edge's covariance: without any drift it would have no inverse.
const Mat6 kLeastCovariance = 1e-12 * Mat6::Identity();

/// Covariance of what is left of an odometry edge when it begins at C instead of the base. The
/// drift grows evenly, so that a share of all of it is left, whatever the edge consists of.
Mat6 WithoutDriftBefore(const SubmapAnchor& anchor, const Mat6& edge) {
  const double before = anchor.drift_before.topLeftCorner<2, 2>().trace();
  const double all = edge.topLeftCorner<2, 2>().trace();
  constexpr double kMost = 0.5;
  return (1 - (all > 0 ? std::min(kMost, before / all) : 0)) * edge;
}

}  // namespace

Pose3 NodeIn(const Pose3& X_ML, NodePlace place) {
  return place == NodePlace::kFirst ? Pose3::Identity() : Exp(0.5 * Log(X_ML));
}

SubmapAnchor AnchorOf(const Submap& submap, NodePlace place) {
  const Mat3& D = submap.drift;
  const Pose3 X_MC = NodeIn(submap.X_ML, place);
  if (place == NodePlace::kFirst) return {X_MC, D / 6, D / 3, Mat3::Zero()};
  return {X_MC, D / 6, D / 12, D / 2};
}

SlamSettings SlamSettings::From(const Config& config) {
  return {config.Read<SlamOptions>("slam"), config.Read<LoopClosureOptions>("loop_closure"),
          config.Read<IcpOptions>("registration"), config.Read<PoseGraphOptions>("pose_graph"),
          config.Read<SensorModelOptions>("sensor_model")};
}

Slam::Slam(const SlamSettings& settings, RegistrationHook hook)
    : settings_(settings),
      hook_(std::move(hook)),
      occupied_from_(SensorModel(settings.sensor_model).occupied_from),
      graph_(settings.pose_graph) {}

Slam::~Slam() = default;

void Slam::AddSubmap(const SubmapPtr& submap) {
  AddNode(*submap);
  if (settings_.slam.loop_closures) {
    auto& shape = shapes_[submap->id()];
    shape = std::make_unique<SubmapShape>(submap, anchors_.at(submap->id()), occupied_from_,
                                          settings_.loop_closure, settings_.registration);
    CloseLoops(*shape);
    graph_.Solve();
    if (DropContradicting()) graph_.Solve();
    KeepIfNeeded(submap->id());
  }
  PlaceSubmaps();
  UpdateCovariances();
  ++version_;
}

void Slam::AddNode(const Submap& submap) {
  const bool is_first = anchors_.empty();
  const SubmapAnchor& anchor = anchors_[submap.id()] = AnchorOf(submap, settings_.slam.node);
  const Pose3 X_OC = submap.base.odometry.X_OB * anchor.X_MC;
  const RollPitchYaw angles = AnglesOf(X_OC);
  const AbsolutePrior prior{X_OC.translation().z(), angles.roll, angles.pitch,
                            settings_.slam.prior_sigma_z_m, settings_.slam.prior_sigma_angle_rad};
  if (is_first) {
    graph_.AddNode(submap.id(), X_OC);
    graph_.SetPrior(submap.id(), prior);
    return;
  }
  const SubmapAnchor& before = anchors_.at(submap.id() - 1);
  const OdometryEdge& edge = submap.base.edge;
  const Pose3 X_CC = before.X_MC.inverse() * edge.X_PM * anchor.X_MC;
  graph_.AddNode(submap.id(), graph_.X_W(submap.id() - 1) * X_CC);
  graph_.SetPrior(submap.id(), prior);
  const Mat6 Ad = AdjointOf(anchor.X_MC.inverse());
  const Mat6 covariance = Ad * WithoutDriftBefore(before, edge.covariance) * Ad.transpose() +
                          PlanarTo6(anchor.drift_before) + kLeastCovariance;
  graph_.AddConstraint(
      {submap.id() - 1, submap.id(), ConstraintKind::kOdometry, X_CC, WhiteningOf(covariance)});
}

void Slam::PlaceSubmaps() {
  for (const auto& [id, X_WC] : graph_.nodes()) X_WM_[id] = X_WC * anchors_.at(id).X_MC.inverse();
}

Constraint Slam::BetweenBases(Constraint constraint) const {
  const Pose3& X_MC_i = anchors_.at(constraint.from).X_MC;
  const Pose3 X_CM_k = anchors_.at(constraint.to).X_MC.inverse();
  constraint.X_ik = X_MC_i * constraint.X_ik * X_CM_k;
  // X Exp(xi) in C is X_CM (X_MC X X_CM Exp(Ad(X_MC) xi)) X_MC.
  constraint.whitening = constraint.whitening * AdjointOf(X_CM_k);
  return constraint;
}

G2oGraph Slam::ToG2o() const {
  std::map<int, Constraint> between_bases;
  for (const auto& [number, constraint] : graph_.constraints())
    between_bases.emplace(number, BetweenBases(constraint));
  return ToG2oGraph(X_WM_, between_bases);
}

void Slam::CloseLoops(const SubmapShape& source) {
  const bool is_lost = IsLostAmongAll(source.id);
  if (is_lost) FindItself(source, LostCandidates(source));
  const LoopClosureOptions& options = settings_.loop_closure;
  std::vector<LoopCandidate> candidates = OverlappingSubmaps(source);
  auto alone = candidates;
  std::erase_if(alone, [&](const LoopCandidate& candidate) {
    return candidate.predicted_overlap < options.min_predicted_overlap;
  });
  KeepBest(options, &LoopCandidate::information, alone);
  CloseWith(source, std::move(alone));
  if (options.region_submaps > 1 && !IsPlaced(source.id)) {
    std::erase_if(candidates, [&](const LoopCandidate& candidate) {
      return IsJoined(candidate.id, source.id);
    });
    CloseWith(source, JoinRegions(options, settings_.registration, graph_, std::move(candidates)));
  }
  if (!is_lost && AcceptedOf(source.id).empty()) FindItself(source, LostCandidates(source));
}

std::vector<LoopCandidate> Slam::OverlappingSubmaps(const SubmapShape& source) const {
  std::vector<const SubmapShape*> targets;
  std::vector<Pose3> X_ik;
  for (const auto& [id, shape] : shapes_) {
    if (id == source.id || IsJoined(id, source.id)) continue;
    targets.push_back(shape.get());
    X_ik.push_back(PredictedX_ik(id, source.id));
  }
  auto candidates = FindCandidates(settings_.loop_closure, targets, source, X_ik);
  PredictCovariances(source.id, candidates);
  for (LoopCandidate& candidate : candidates)
    candidate.information =
        ExpectedInformation(settings_.registration, *candidate.members.front().shape, source,
                            PredictedX_ik(candidate.id, source.id), candidate);
  return candidates;
}

void Slam::CloseWith(const SubmapShape& source, std::vector<LoopCandidate> candidates) {
  for (LoopCandidate& candidate : candidates)
    candidate.starts = {PredictedX_ik(candidate.id, source.id)};
  for (const LoopClosure& loop : Try(source, candidates)) Close(loop);
}

/// The one registration that fits best has to be right: what is as uncertain as this is
/// contradicted by little else. All others are judged by the place that it finds. One that leaves
/// directions open may fit a thing that looks like the right one: where another fits and
/// contradicts it, none is taken.
void Slam::FindItself(const SubmapShape& source, const std::vector<LoopCandidate>& lost) {
  std::vector<LoopClosure> loops = Try(source, lost);
  std::erase_if(loops, [](const LoopClosure& loop) { return !loop.accepted; });
  if (loops.empty()) return;
  const auto merit = [](const LoopClosure& loop) {
    return std::pair(loop.constraint.kind != ConstraintKind::kFullClosure,
                     loop.rmse_m / loop.overlap);
  };
  const LoopClosure best = *std::min_element(
      loops.begin(), loops.end(),
      [&](const LoopClosure& a, const LoopClosure& b) { return merit(a) < merit(b); });
  Close(best);
  graph_.Solve();
  if (best.constraint.kind == ConstraintKind::kFullClosure) return;
  if (std::all_of(loops.begin(), loops.end(), [&](const LoopClosure& loop) {
        return graph_.ChiSquareOf(loop.constraint) <= ChiSquare99(loop.directions);
      }))
    return;
  Closure& closed = closures_.back();
  graph_.RemoveConstraint(closed.constraint);
  closed = {Reject(closed.loop, "more than one place fits"), -1};
  graph_.Solve();
}

bool Slam::IsLostAmongAll(SubmapId newest) const {
  const double edge_sigma_m = NewestEdgeSigma_m();
  std::vector<LoopCandidate> others;
  for (const auto& [id, shape] : shapes_) {
    if (newest - id < settings_.loop_closure.min_separation) continue;
    // Where one is known well, all others are known as well as the graph can tell.
    if (!MayBeLost(id, edge_sigma_m)) return false;
    others.push_back({id});
  }
  PredictCovariances(newest, others);
  return !others.empty() && std::all_of(others.begin(), others.end(), [&](const auto& other) {
    return IsLost(settings_.registration, HorizontalSigma(other.covariance));
  });
}

double Slam::NewestEdgeSigma_m() const {
  const auto newest = graph_.constraints().rbegin();
  return newest == graph_.constraints().rend()
             ? 0
             : HorizontalSigma(newest->second.Information().inverse());
}

bool Slam::MayBeLost(SubmapId id, double edge_sigma_m) const {
  return IsLost(settings_.registration,
                HorizontalSigma(covariances_.at(id).of_X_MN) + edge_sigma_m);
}

std::vector<LoopCandidate> Slam::LostCandidates(const SubmapShape& source) const {
  const LoopClosureOptions& options = settings_.loop_closure;
  const double edge_sigma_m = NewestEdgeSigma_m();
  std::vector<LoopCandidate> lost;
  for (const auto& [id, shape] : shapes_) {
    if (source.id - id < options.min_separation || !MayBeLost(id, edge_sigma_m)) continue;
    lost.push_back({id});
    lost.back().members = {{shape.get()}};
  }
  PredictCovariances(source.id, lost);
  std::erase_if(lost, [&](const LoopCandidate& candidate) {
    return !IsLost(settings_.registration, HorizontalSigma(candidate.covariance));
  });
  ParallelFor(lost.size(), [&](std::size_t c) {
    LoopCandidate& candidate = lost[c];
    for (const SearchPlace& place :
         SearchPlaces(settings_.registration, *shapes_.at(candidate.id), source,
                      PredictedX_ik(candidate.id, source.id), candidate.covariance)) {
      candidate.starts.push_back(place.X_ik);
      candidate.predicted_overlap = std::max(candidate.predicted_overlap, place.overlap);
    }
  });
  std::erase_if(lost, [&](const LoopCandidate& candidate) {
    return candidate.predicted_overlap < options.min_predicted_overlap;
  });
  KeepBest(options, &LoopCandidate::predicted_overlap, lost);
  return lost;
}

std::vector<LoopClosure> Slam::Try(const SubmapShape& source,
                                   const std::vector<LoopCandidate>& candidates) {
  std::vector<std::optional<SubmapRegion>> regions(candidates.size());
  std::vector<SearchResult> found(candidates.size());
  ParallelFor(candidates.size(), [&](std::size_t c) {
    regions[c] = RegionOf(candidates[c], source);
    found[c] = RegisterFrom(settings_.registration, *regions[c], source, candidates[c].starts);
  });
  if (hook_) {
    for (std::size_t c = 0; c < candidates.size(); ++c)
      hook_(candidates[c].id, source.id, found[c].registration);
  }
  std::vector<LoopClosure> loops(candidates.size());
  ParallelFor(candidates.size(), [&](std::size_t c) {
    loops[c] =
        Judge(settings_.loop_closure, settings_.registration, found[c].registration, *regions[c],
              source, PredictedX_ik(candidates[c].id, source.id), candidates[c].covariance);
    if (loops[c].accepted && found[c].is_ambiguous)
      loops[c] = Reject(loops[c], "more than one place fits");
  });
  return loops;
}

SubmapRegion Slam::RegionOf(const LoopCandidate& candidate, const SubmapShape& source) const {
  if (candidate.members.size() == 1) return *candidate.members.front().shape;
  return {candidate.members, source, PredictedX_ik(candidate.id, source.id)};
}

void Slam::Close(const LoopClosure& loop) {
  closures_.push_back({loop, loop.accepted ? graph_.AddConstraint(loop.constraint) : -1});
}

std::vector<const LoopClosure*> Slam::AcceptedOf(SubmapId newest) const {
  std::vector<const LoopClosure*> accepted;
  for (auto closure = closures_.rbegin(); closure != closures_.rend(); ++closure) {
    if (closure->loop.to != newest) break;
    if (closure->loop.accepted) accepted.push_back(&closure->loop);
  }
  return accepted;
}

bool Slam::IsPlaced(SubmapId newest) const {
  const auto accepted = AcceptedOf(newest);
  return std::count_if(accepted.begin(), accepted.end(), [](const LoopClosure* loop) {
           return loop->constraint.kind == ConstraintKind::kFullClosure;
         }) >= kEnoughFullClosures;
}

bool Slam::IsJoined(SubmapId from, SubmapId newest) const {
  const auto accepted = AcceptedOf(newest);
  return std::any_of(accepted.begin(), accepted.end(),
                     [&](const LoopClosure* loop) { return loop->from == from; });
}

Pose3 Slam::PredictedX_ik(NodeId i, NodeId k) const { return Ominus(graph_.X_W(i), graph_.X_W(k)); }

void Slam::PredictCovariances(NodeId newest, std::vector<LoopCandidate>& candidates) const {
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (const LoopCandidate& candidate : candidates) pairs.emplace_back(candidate.id, newest);
  if (pairs.empty()) return;
  const auto covariances = graph_.RoughRelativeCovariances(pairs);
  for (std::size_t c = 0; c < candidates.size(); ++c)
    candidates[c].covariance = covariances.empty() ? kNoPrediction : covariances[c];
}

bool Slam::DropContradicting() {
  bool dropped = false;
  for (Closure& closure : closures_) {
    if (!closure.loop.accepted) continue;
    closure.loop.chi_square = graph_.ChiSquareOf(closure.loop.constraint);
    if (closure.loop.chi_square <= ChiSquare99(closure.loop.directions)) continue;
    graph_.RemoveConstraint(closure.constraint);
    closure.constraint = -1;
    closure.loop = Reject(closure.loop, "contradicts the other closures");
    dropped = true;
  }
  return dropped;
}

void Slam::KeepIfNeeded(SubmapId newest) {
  const SubmapShape& shape = *shapes_.at(newest);
  std::vector<const SubmapShape*> others;
  std::vector<Pose3> X_ik;
  for (const auto& [id, other] : shapes_) {
    if (id == newest) continue;
    others.push_back(other.get());
    X_ik.push_back(PredictedX_ik(id, newest));
  }
  if (!IsNeeded(settings_.loop_closure, others, shape, X_ik)) shapes_.erase(newest);
}

Mat3 Slam::OwnInformation(const SubmapShape& shape) const {
  LoopClosureOptions options = settings_.loop_closure;
  options.both_ways = false;
  const auto itself = Register(settings_.registration, shape.cloud, shape.cloud, Pose3::Identity());
  const LoopClosure loop = Judge(options, settings_.registration, itself, shape, shape,
                                 Pose3::Identity(), kNoPrediction);
  return loop.accepted ? PlanarOf(loop.constraint.Information()) : Mat3::Zero();
}

std::map<SubmapId, double> Slam::ExpectedRevisits() {
  if (shapes_.empty()) return {};
  for (const auto& [id, shape] : shapes_)
    if (!own_information_.count(id)) own_information_[id] = OwnInformation(*shape);
  const auto variance_m2 = [](const SubmapAnchor& anchor) {
    return anchor.body_drift.topLeftCorner<2, 2>().trace();
  };
  return ExpectRevisits(
      graph_, own_information_,
      variance_m2(anchors_.begin()->second) + variance_m2(anchors_.rbegin()->second));
}

void Slam::UpdateCovariances() {
  const NodeId first = graph_.nodes().begin()->first, newest = graph_.nodes().rbegin()->first;
  std::vector<std::pair<NodeId, NodeId>> pairs;
  for (const auto& [id, X_W] : graph_.nodes()) {
    pairs.emplace_back(first, id);
    pairs.emplace_back(id, newest);
  }
  auto covariances = graph_.RoughRelativeCovariances(pairs);
  AddBodyDrift(pairs, covariances);
  if (covariances.empty()) covariances.assign(pairs.size(), kNoPrediction);
  covariances_.clear();
  for (std::size_t p = 0; p < pairs.size(); p += 2) {
    const SubmapId id = pairs[p].second;
    // From X Exp(xi) at the node C to the same at the base M.
    const Mat6 Ad_of = AdjointOf(anchors_.at(id).X_MC);
    const Mat6 Ad_newest = AdjointOf(anchors_.at(newest).X_MC);
    covariances_[id] = {Ad_of * covariances[p] * Ad_of.transpose(),
                        Ad_newest * covariances[p + 1] * Ad_newest.transpose()};
  }
}

std::vector<Mat6> Slam::BodyCovariances(const std::vector<std::pair<NodeId, NodeId>>& pairs) const {
  std::vector<Mat6> covariances = graph_.RelativeCovariances(pairs);
  AddBodyDrift(pairs, covariances);
  return covariances;
}

void Slam::AddBodyDrift(const std::vector<std::pair<NodeId, NodeId>>& pairs,
                        std::vector<Mat6>& covariances) const {
  for (std::size_t p = 0; p < covariances.size(); ++p) {
    const auto& [i, k] = pairs[p];
    if (i == k) continue;
    covariances[p] = BodyCovariance(covariances[p], Ominus(graph_.X_W(i), graph_.X_W(k)),
                                    anchors_.at(i), anchors_.at(k));
  }
}

}  // namespace vog
