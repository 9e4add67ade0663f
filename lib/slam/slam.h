#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lib/loopclosure/loop_closure.h"
#include "lib/posegraph/g2o.h"
#include "lib/posegraph/pose_graph.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// Which of a submap's poses is its node in the graph.
enum class NodePlace {
  kFirst,   ///< The base: where the body was at the first scan.
  kMiddle,  ///< Halfway to the last scan.
};

struct SlamOptions {
  bool loop_closures = true;
  NodePlace node = NodePlace::kFirst;
  double prior_sigma_z_m = 0.02;
  double prior_sigma_angle_rad = 0.005;

  void Visit(OptionsVisitor& v) {
    v("loop_closures", loop_closures, "look for loop closures; without, poses are odometry's");
    v("node", node, Names<NodePlace>{{NodePlace::kFirst, "first"}, {NodePlace::kMiddle, "middle"}},
      "the pose of a submap that is its node: at its first scan, or halfway to its last");
    v("prior_sigma_z_m", prior_sigma_z_m, Between(1e-4, 10), "of a node's measured depth");
    v("prior_sigma_angle_rad", prior_sigma_angle_rad, Between(1e-5, 3),
      "of a node's measured roll and pitch");
  }
};

/// A submap's node C in its own frame, X_MC, from the body's motion to its last scan.
Pose3 NodeIn(const Pose3& X_ML, NodePlace place);

/// What drift makes of a submap's node. From first to last scan the body drifts by a random walk of
/// covariance D. The walk's mean, which is what all of the content tells, has covariance D / 3
/// about its beginning and D / 12 about its middle; a moment of it, at which a part of the content
/// was seen, D / 6 about the mean.
SubmapAnchor AnchorOf(const Submap& submap, NodePlace place);

/// All options of the SLAM part.
struct SlamSettings {
  SlamOptions slam;
  LoopClosureOptions loop_closure;
  IcpOptions registration;
  PoseGraphOptions pose_graph;
  SensorModelOptions sensor_model;

  static SlamSettings From(const Config& config);
};

/// How well the place of a submap is known. Of the body's pose at its base, right perturbation;
/// huge where the graph does not determine all poses.
struct PlaceCovariance {
  Mat6 of_X_WM = Mat6::Zero();  ///< In the world, which stands where the body was at first.
  Mat6 of_X_MN = Mat6::Zero();  ///< Of the motion from here to the newest submap's base N.
};

/// Sees, and may change, each registration before it is judged: to study what wrong ones do. Called
/// in the order of the candidates.
using RegistrationHook = std::function<void(SubmapId target, SubmapId source, IcpResult&)>;

/// Submap SLAM, section IV-A: each closed submap becomes a node, joined to the one before by
/// odometry and to earlier ones by registrations that passed their tests; then eq. 6 is solved.
/// Pure: the same submaps in the same order give the same poses.
class Slam {
 public:
  explicit Slam(const SlamSettings& settings, RegistrationHook hook = nullptr);
  ~Slam();

  /// Adds the next submap and solves. @pre submaps come in the order of their numbers, none left
  /// out, the first one with any number.
  void AddSubmap(const SubmapPtr& submap);

  /// Grows by one with every submap.
  std::int64_t version() const { return version_; }
  /// Its nodes are the submaps' frames C.
  const PoseGraph& graph() const { return graph_; }
  /// Where the submaps are: X_WC * X_MC^-1.
  const std::map<SubmapId, Pose3>& X_WM() const { return X_WM_; }
  /// A constraint between nodes as one between the submaps' bases; the chi-square is the same.
  Constraint BetweenBases(Constraint constraint) const;
  /// The graph between the submaps' bases.
  G2oGraph ToG2o() const;

  /// A closure of the graph, and its number there; a rejected one has none.
  struct Closure {
    LoopClosure loop;
    int constraint = -1;
  };
  /// Every closure that was tried, in order.
  const std::vector<Closure>& closures() const { return closures_; }

  /// Covariances of the body's motions from i to k, right perturbation, where C is at both: the
  /// graph's and what drift inside the two submaps adds. Empty when the graph does not determine
  /// all poses.
  std::vector<Mat6> BodyCovariances(const std::vector<std::pair<NodeId, NodeId>>& pairs) const;

  /// One for each submap, right to some percent.
  const std::map<SubmapId, PlaceCovariance>& covariances() const { return covariances_; }

  /// What seeing earlier submaps again would gain (ExpectRevisits()); without loop closures
  /// nothing.
  /// Registers each submap that loops are closed with with itself, once.
  std::map<SubmapId, double> ExpectedRevisits();

 private:
  void AddNode(const Submap& submap);
  void PlaceSubmaps();
  /// With each submap alone, and where that does not tell the place, with regions of them.
  void CloseLoops(const SubmapShape& source);
  /// All that the newest submap is predicted to overlap, and how much each would tell.
  std::vector<LoopCandidate> OverlappingSubmaps(const SubmapShape& source) const;
  /// Registers from the predicted poses, judges, and closes.
  void CloseWith(const SubmapShape& source, std::vector<LoopCandidate> candidates);
  /// Whether the newest submap's place is so uncertain relative to all others that registrations
  /// from the predicted poses would miss it.
  bool IsLostAmongAll(SubmapId newest) const;
  /// Of the motion from the last submap to the newest one. @pre that has closed no loop yet.
  double NewestEdgeSigma_m() const;
  /// Whether the newest submap may be so uncertain relative to an earlier one: no pair is more
  /// uncertain than that relative to the last submap and the newest edge together.
  bool MayBeLost(SubmapId id, double edge_sigma_m) const;
  /// The submaps relative to which the newest one is so uncertain, to which it may belong, and
  /// where registrations should begin.
  std::vector<LoopCandidate> LostCandidates(const SubmapShape& source) const;
  void FindItself(const SubmapShape& source, const std::vector<LoopCandidate>& lost);
  /// Registers and judges, from each candidate's starts.
  std::vector<LoopClosure> Try(const SubmapShape& source,
                               const std::vector<LoopCandidate>& candidates);
  SubmapRegion RegionOf(const LoopCandidate& candidate, const SubmapShape& source) const;
  void Close(const LoopClosure& loop);
  std::vector<const LoopClosure*> AcceptedOf(SubmapId newest) const;
  /// Whether its closures tell its place, one confirming another.
  bool IsPlaced(SubmapId newest) const;
  /// Whether the newest submap has a closure with an earlier one.
  bool IsJoined(SubmapId from, SubmapId newest) const;
  Pose3 PredictedX_ik(NodeId i, NodeId k) const;
  void PredictCovariances(NodeId newest, std::vector<LoopCandidate>& candidates) const;
  bool DropContradicting();
  /// Forgets the newest submap's shape where enough others hold its content already.
  void KeepIfNeeded(SubmapId newest);
  /// What a closure of a submap with its like tells of (x, y, yaw); zero if there would be none.
  Mat3 OwnInformation(const SubmapShape& shape) const;
  void UpdateCovariances();
  /// From covariances between nodes to those of the body's motions.
  void AddBodyDrift(const std::vector<std::pair<NodeId, NodeId>>& pairs,
                    std::vector<Mat6>& covariances) const;

  SlamSettings settings_;
  RegistrationHook hook_;
  LogOddsUnits occupied_from_;
  PoseGraph graph_;
  std::map<SubmapId, SubmapAnchor> anchors_;
  std::map<SubmapId, Pose3> X_WM_;
  std::map<SubmapId, std::unique_ptr<SubmapShape>> shapes_;  ///< Those that loops are closed with.
  std::map<SubmapId, Mat3> own_information_;  ///< Of shapes_, as ExpectedRevisits() left them.
  std::vector<Closure> closures_;
  std::map<SubmapId, PlaceCovariance> covariances_;
  std::int64_t version_ = 0;
};

}  // namespace vog
