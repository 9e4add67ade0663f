#pragma once

#include <vector>

#include "lib/geometry/pose.h"
#include "vog/graph_edge_t.hpp"

namespace vog {

/// What a partial closure does not bind of the pose of `to`: unit vectors in its frame.
struct FreeMotions {
  std::vector<Vec3> directions;  ///< Along which its position is free.
  std::vector<Vec3> axes;        ///< About which it may turn.
};

/// Nothing of any other edge.
FreeMotions FreeMotionsOf(const graph_edge_t& edge);

}  // namespace vog
