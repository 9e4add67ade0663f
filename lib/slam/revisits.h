#pragma once

#include <map>

#include "lib/posegraph/pose_graph.h"
#include "lib/submap/submap.h"

namespace vog {

/// What seeing submaps again now would gain: the share of the graph's mean position error that a
/// loop closure of a new submap with each of `targets`, made where the target was, would take away.
/// `targets` holds the information of such a closure of (x, y, yaw), right perturbation. The mean
/// is over some of the nodes, spread evenly, of the horizontal standard deviation relative to the
/// first node, to which `body_variance_m2`, that nothing reduces, is added. Those that gain less
/// than 0.03 are left out.
///
/// A measurement of z = x_N - x_j that leaves the share s of its variance V_jN takes
/// (1 - s) C^2 / V_jN from that of a node k, with C = cov(x_k - x_0, z) =
/// (V_jk + V_0N - V_kN - V_0j) / 2; positions only, as if headings did not matter beyond V_jN.
/// Cost: a dozen solves with the graph's kept factor; one where none can gain enough. Empty when
/// the graph does not determine all poses.
std::map<SubmapId, double> ExpectRevisits(const PoseGraph& graph,
                                          const std::map<SubmapId, Mat3>& targets,
                                          double body_variance_m2);

}  // namespace vog
