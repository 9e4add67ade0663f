#include "sim/scene/scene.h"

#include "sim/scene/mesh_file.h"
#include "sim/scene/mine.h"
#include "sim/scene/pier.h"
#include "sim/scene/propeller.h"
#include "sim/scene/seafloor.h"
#include "sim/scene/tank.h"
#include "sim/scene/wreck.h"

namespace vog {
namespace {

TriangleMesh LoadScene(const SceneOptions& options, const std::filesystem::path& directory) {
  if (options.mesh.empty())
    throw UsageError("scene.kind \"mesh\" needs the name of a file: set scene.mesh");
  return LoadMesh(directory / options.mesh, options.mesh_scale);
}

}  // namespace

SceneSettings SceneSettings::From(const Config& config) {
  return {
      config.Read<SceneOptions>("scene"),       config.Read<PropellerOptions>("scene.propeller"),
      config.Read<TankOptions>("scene.tank"),   config.Read<PierOptions>("scene.pier"),
      config.Read<WreckOptions>("scene.wreck"), config.Read<SeafloorOptions>("scene.seafloor"),
      config.Read<MineOptions>("scene.mine"),   config.directory()};
}

TriangleMesh MakeScene(const SceneSettings& settings) {
  const std::int64_t seed = settings.scene.seed;
  switch (settings.scene.kind) {
    case SceneKind::kPropeller:
      return GeneratePropeller(settings.propeller);
    case SceneKind::kTank:
      return GenerateTank(settings.tank);
    case SceneKind::kPier:
      return GeneratePier(settings.pier, seed);
    case SceneKind::kWreck:
      return GenerateWreck(settings.wreck, seed);
    case SceneKind::kSeafloor:
      return GenerateSeafloor(settings.seafloor, seed);
    case SceneKind::kMine:
      return GenerateMine(settings.mine);
    case SceneKind::kMesh:
      break;
  }
  return LoadScene(settings.scene, settings.directory);
}

}  // namespace vog
