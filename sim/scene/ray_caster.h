#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "lib/geometry/triangle_mesh.h"

namespace vog {

/// Where a ray meets a surface.
struct RayHit {
  double range_m = 0;
  Vec3 normal_W = Vec3::Zero();  ///< Of the triangle as wound, unit.
  std::uint32_t triangle = 0;    ///< Its number in the mesh.
};

/// Casts rays at a mesh, with Embree [Wald et al. 2014]. Good to some micrometres, wherever the
/// mesh is. Queries may run at the same time on several threads.
class RayCaster {
 public:
  explicit RayCaster(const TriangleMesh& mesh);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// The first triangle, of either side, that the ray meets. @pre direction_W is a unit vector.
  std::optional<RayHit> Cast(const Vec3& origin_W, const Vec3& direction_W,
                             double max_range_m) const;

  /// Whether something stands between two points. The last millimetre at either end does not count,
  /// so that points on a surface can be asked about.
  bool Occluded(const Vec3& from_W, const Vec3& to_W) const;

  /// Whether the point is inside a solid: how often the surfaces wind around it, estimated with
  /// rays in many directions [after Jacobson et al. 2013]. So meshes may have holes, overlap, or be
  /// wound inward.
  bool Inside(const Vec3& p_W) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace vog
