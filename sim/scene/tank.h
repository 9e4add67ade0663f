#pragma once

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// The tank with its floor, the box and the ladder, in W. Each part is a closed shell of its own;
/// neighbouring parts overlap. @throws UsageError like Validate().
TriangleMesh GenerateTank(const TankOptions& options);

}  // namespace vog
