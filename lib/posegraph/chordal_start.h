#pragma once

#include <map>
#include <optional>

#include "lib/posegraph/pose_graph.h"

namespace vog {

/// Poses to start a solve from that need no good guess, found by two linear solves [Carlone et al.
/// 2015]: rotations as free 3 x 3 matrices that agree best with the constraints, each then replaced
/// by the nearest rotation; with them translations. Priors have no say. Nodes that `graph` holds
/// stay. Nothing when the constraints do not determine all poses.
std::optional<std::map<NodeId, Pose3>> ChordalStart(const PoseGraph& graph);

/// Moves the nodes of `graph` to the chordal start if its cost is lower than that of where they
/// are.
void StartFromTheBetter(PoseGraph& graph);

}  // namespace vog
