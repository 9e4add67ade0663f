#pragma once

#include <map>
#include <string>
#include <vector>

#include "lib/posegraph/pose_graph.h"

namespace vog {

struct G2oEdge {
  NodeId from = 0, to = 0;
  Pose3 X_ik = Pose3::Identity();
  Mat6 information = Mat6::Identity();
};

/// What a .g2o file holds.
struct G2oGraph {
  std::map<NodeId, Pose3> vertices;
  std::vector<G2oEdge> edges;
};

/// The nodes and constraints of a pose graph.
G2oGraph ToG2oGraph(const PoseGraph& graph);

/// The text of a .g2o file: VERTEX_SE3:QUAT (poses in W), FIX for the first, EDGE_SE3:QUAT. The
/// information of an edge is that of a Constraint's residual: order x, y, z, then rotations in
/// radians. (g2o itself reads the rotation part as that of half angles.) Numbers read back exactly.
std::string ToG2oText(const G2oGraph& graph);

}  // namespace vog
