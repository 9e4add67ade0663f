#pragma once

#include <memory>

#include "lib/geometry/pose.h"
#include "lib/geometry/triangle_mesh.h"

namespace vog {

/// Distance of the vehicle's box from a mesh, by FCL: the judge of collisions where the truth is
/// known.
class MeshClearance {
 public:
  MeshClearance(const TriangleMesh& mesh_W, const Vec3& hull_size_m);
  ~MeshClearance();

  /// Whether the box touches a triangle. A box wholly inside a solid touches none.
  bool Collides(const Pose3& X_WB) const;

  /// The distance between box and mesh [m]; 0 when they touch.
  double DistanceAt(const Pose3& X_WB) const;

 private:
  struct Models;
  std::unique_ptr<Models> models_;
};

}  // namespace vog
