#pragma once

#include "lib/geometry/triangle_mesh.h"

namespace vog {

/// Whether a box, its sides along the axes of B and its middle at B's origin, touches a triangle of
/// the mesh (or holds it). Exact, by separating axes [Akenine-Moller 2001]. Linear in the
/// triangles, with a few nanoseconds for each that is far away.
bool BoxTouches(const TriangleMesh& mesh, const Pose3& X_WB, const Vec3& size_m);

}  // namespace vog
