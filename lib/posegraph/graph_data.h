#pragma once

#include <map>
#include <set>

#include "lib/posegraph/constraint.h"

namespace vog {

/// What a pose graph consists of.
struct GraphData {
  std::map<NodeId, Pose3> nodes;  ///< X_W.
  std::map<NodeId, AbsolutePrior> priors;
  std::map<int, Constraint> constraints;  ///< By number; a new one has the highest so far.
  std::set<NodeId> fixed;                 ///< Beside the node with the smallest number.

  bool IsFixed(NodeId id) const { return id == nodes.begin()->first || fixed.count(id) > 0; }
};

}  // namespace vog
