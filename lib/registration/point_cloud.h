#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "lib/geometry/pose.h"
#include "lib/registration/kd_tree.h"

namespace vog {

/// The plane through a point's neighbours.
struct LocalPlane {
  Vec3 normal = Vec3::Zero();  ///< Zero without a plane.
  double variance_m2 = 0;      ///< Of the neighbours across it.
  double scatter_m2 = 0;       ///< Sum of their squared distances along its narrower direction.

  /// Of the angle that noise tilts the normal by, in any direction across it [rad^2]; points err
  /// by `point_sigma_m` at least. @pre there is a plane.
  double TiltVariance(double point_sigma_m) const {
    return std::max(variance_m2, point_sigma_m * point_sigma_m) / scatter_m2;
  }
};

/// Points with a surface normal each and a search tree over them. Not changed after it is made.
class RegistrationCloud {
 public:
  /// Normals are those of the plane through each point's neighbours within `normal_radius_m`,
  /// turned to the side of `seen_from`. Points without a plane get a zero normal. O(n log n).
  RegistrationCloud(std::vector<Vec3> points, double normal_radius_m, const Vec3& seen_from);
  /// Their planes are known. @pre there are as many.
  RegistrationCloud(std::vector<Vec3> points, std::vector<LocalPlane> planes);
  RegistrationCloud(const RegistrationCloud&) = delete;
  RegistrationCloud& operator=(const RegistrationCloud&) = delete;

  const std::vector<Vec3>& points() const { return points_; }
  const std::vector<LocalPlane>& planes() const { return planes_; }
  std::size_t size() const { return points_.size(); }
  /// Root mean square distance of the points from the frame's origin, at least 0.1: how far a
  /// rotation of 1 rad moves them.
  double radius_m() const { return radius_m_; }

  /// The point nearest to `p` if it is nearer than `max_m`.
  std::optional<KdTree::Neighbour> NearestWithin(const Vec3& p, double max_m) const {
    return tree_->NearestWithin(p, max_m);
  }

 private:
  std::vector<Vec3> points_;
  std::vector<LocalPlane> planes_;
  double radius_m_;
  std::unique_ptr<KdTree> tree_;
};

}  // namespace vog
