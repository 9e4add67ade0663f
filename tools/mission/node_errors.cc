#include "tools/mission/node_errors.h"

#include <array>

#include "lib/posegraph/g2o.h"

namespace vog {
namespace {

/// x, y and yaw among the six coordinates.
constexpr std::array kPlanarRows = {0, 1, 5};

/// The map's graph between the submaps' bases, at its solution. Its file has no priors.
PoseGraph GraphOf(const StoredMap& map, const SlamOptions& options) {
  const G2oGraph g2o = ParseG2o(map.graph_g2o, "graph.g2o").graph;
  PoseGraph graph = ToPoseGraph(g2o, {}, RotationInformation::kRadians, Objective::kGeodesic);
  for (const auto& [id, X_WM] : g2o.vertices) {
    const RollPitchYaw angles = AnglesOf(X_WM);
    graph.SetPrior(id, {X_WM.translation().z(), angles.roll, angles.pitch, options.prior_sigma_z_m,
                        options.prior_sigma_angle_rad});
  }
  return graph;
}

}  // namespace

ErrorsOfNodes NodeErrors(const StoredMap& map, const SlamOptions& options,
                         const std::map<SubmapId, SubmapTruth>& truth) {
  const PoseGraph graph = GraphOf(map, options);
  std::vector<SubmapPtr> judged;
  std::vector<std::pair<NodeId, NodeId>> from_first;
  for (const SubmapPtr& submap : map.submaps) {
    if (!graph.nodes().count(submap->id()) || !truth.count(submap->id())) continue;
    judged.push_back(submap);
    from_first.emplace_back(graph.nodes().begin()->first, submap->id());
  }
  if (judged.empty() || judged.front()->id() != graph.nodes().begin()->first) return {};
  const std::vector<Mat6> covariances = graph.RelativeCovariances(from_first);
  if (covariances.empty()) return {};

  const auto node = [&](const Submap& submap) {
    return Level(graph.X_W(submap.id()) * NodeIn(submap.X_ML, options.node));
  };
  const auto true_node = [&](const Submap& submap) {
    const auto& [X_WM, X_WL] = truth.at(submap.id());
    return Level(X_WM * NodeIn(Ominus(X_WM, X_WL), options.node));
  };
  const Pose3 X_WF = node(*judged.front()), X_WF_true = true_node(*judged.front());
  const SubmapAnchor first = AnchorOf(*judged.front(), options.node);
  ErrorsOfNodes found;
  for (std::size_t i = 1; i < judged.size(); ++i) {
    const Pose3 X_FC = Ominus(X_WF, node(*judged[i]));
    const Vec6 error = Log(Ominus(X_FC, Ominus(X_WF_true, true_node(*judged[i]))));
    const SubmapAnchor anchor = AnchorOf(*judged[i], options.node);
    const Mat6 Ad = AdjointOf(anchor.X_MC.inverse());
    const Mat6 covariance =
        BodyCovariance(Ad * covariances[i] * Ad.transpose(), X_FC, first, anchor);
    found.ids.push_back(judged[i]->id());
    found.errors.push_back({error(kPlanarRows), covariance(kPlanarRows, kPlanarRows)});
  }
  return found;
}

}  // namespace vog
