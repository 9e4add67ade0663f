#pragma once

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// Sphere, horns, the links of the chain and the sinker, in W. Each part is a closed shell of its
/// own. @throws UsageError like Validate().
TriangleMesh GenerateMine(const MineOptions& options);

}  // namespace vog
