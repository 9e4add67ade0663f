#pragma once

#include "lib/collision/mesh_clearance.h"
#include "sim/scene/ray_caster.h"

namespace vog {

/// Where the vehicle's box fits in the true scene.
class HullSpace {
 public:
  HullSpace(const TriangleMesh& scene_W, const Vec3& hull_size_m);

  /// Whether the box fits with its centre at `p_W`, at some heading.
  bool Fits(const Vec3& p_W) const;

  const RayCaster& scene() const { return scene_; }

 private:
  RayCaster scene_;
  MeshClearance clearance_;
};

}  // namespace vog
