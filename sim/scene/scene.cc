#include "sim/scene/scene.h"

#include "sim/scene/mesh_file.h"
#include "sim/scene/propeller.h"
#include "sim/scene/tank.h"

namespace vog {

TriangleMesh MakeScene(const SceneOptions& options, const PropellerOptions& propeller,
                       const TankOptions& tank, const std::filesystem::path& directory) {
  if (options.kind == SceneKind::kPropeller) return GeneratePropeller(propeller);
  if (options.kind == SceneKind::kTank) return GenerateTank(tank);
  if (options.mesh.empty())
    throw UsageError("scene.kind \"mesh\" needs the name of a file: set scene.mesh");
  return LoadMesh(directory / options.mesh, options.mesh_scale);
}

}  // namespace vog
