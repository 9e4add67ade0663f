#pragma once

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// The propeller with hub, cap and shaft, the rudder behind it and the stern above it, in W. Each
/// part is a closed shell of its own; neighbouring parts overlap. @throws UsageError like
/// Validate().
TriangleMesh GeneratePropeller(const PropellerOptions& options);

}  // namespace vog
