#pragma once

#include <filesystem>

#include "lib/geometry/triangle_mesh.h"

namespace vog {

/// Reads a mesh file (STL, OBJ, PLY, DAE, and what else assimp knows) with its vertices times
/// `scale`. z is up: a DAE file says which of its axes that is and is turned; others are taken as
/// they are. Triangles without area, lines and points are left out; equal vertices become one.
/// @throws UsageError naming the file when it is missing, cannot be read or has no triangles.
TriangleMesh LoadMesh(const std::filesystem::path& path, double scale);

/// Writes binary PLY, in single precision. @throws SystemError when it cannot be written.
void SaveMesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace vog
