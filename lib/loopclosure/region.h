#pragma once

#include <memory>
#include <vector>

#include "lib/loopclosure/submap_shape.h"

namespace vog {

/// Earlier submaps that a new one is registered to as if they were one: thin submaps, which share
/// little with each other two by two, show enough together. All are placed relative to the first,
/// the anchor, in whose frame C the region is. One submap alone is a region.
struct SubmapRegion {
  struct Member {
    const SubmapShape* shape;
    Pose3 X_im = Pose3::Identity();  ///< In the anchor's frame, by the graph.
    Mat3 covariance = Mat3::Zero();  ///< Of X_im, (x, y, yaw) of the anchor's frame.
  };

  SubmapRegion(const SubmapShape& alone);  // NOLINT(google-explicit-constructor): it is one.
  /// Takes those of the members' points that lie in cells of `source` at `X_ik`. O(n log n).
  /// @pre the anchor is the first member.
  SubmapRegion(std::vector<Member> members, const SubmapShape& source, const Pose3& X_ik);

  SubmapId id() const { return members.front().shape->id; }

  std::vector<Member> members;
  std::shared_ptr<const RegistrationCloud> cloud;
  /// How far the content lies from where it belongs relative to the anchor: the mean over the
  /// points of what drift inside their submap and the submap's place bring, which is an upper bound
  /// for the mean of the points.
  Mat3 content_drift;
};

}  // namespace vog
