#pragma once

#include <filesystem>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// The structure that `options` ask for, in W. A relative mesh file is looked for in `directory`,
/// that of the configuration. @throws UsageError as the generators and LoadMesh() do.
TriangleMesh MakeScene(const SceneOptions& options, const PropellerOptions& propeller,
                       const TankOptions& tank, const std::filesystem::path& directory);

}  // namespace vog
