#pragma once

#include <map>
#include <vector>

#include "lib/evaluation/consistency.h"
#include "lib/slam/slam.h"
#include "lib/vogmap/map_folder.h"

namespace vog {

/// Where the body truly was at a submap's first and last scan.
struct SubmapTruth {
  Pose3 X_WM = Pose3::Identity(), X_WL = Pose3::Identity();
};

/// What is wrong in the poses of nodes, in the order of their numbers.
struct ErrorsOfNodes {
  std::vector<SubmapId> ids;
  std::vector<PlanarError> errors;  ///< As many.
};

/// What is wrong in the pose of each node relative to the first one, and the covariance that the
/// map's graph and SLAM's priors give it; nothing is registered or solved again. Submaps without
/// truth are left out; none are left when the first has no truth or the graph does not determine
/// all poses.
ErrorsOfNodes NodeErrors(const StoredMap& map, const SlamOptions& options,
                         const std::map<SubmapId, SubmapTruth>& truth);

}  // namespace vog
