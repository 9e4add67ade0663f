#pragma once

#include <filesystem>

#include "lib/base/config.h"

namespace vog {

/// Turns a mission to another structure: the mesh file becomes the scene, the exploration box its
/// bounds plus 3 m, and the start the first corner of that box where the vehicle fits, facing the
/// mesh.
/// @throws UsageError when the mesh cannot be read or the vehicle fits into no corner.
void UseMesh(const std::filesystem::path& mesh, Config& config);

}  // namespace vog
