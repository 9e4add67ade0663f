#pragma once

#include <filesystem>

#include "lib/geometry/triangle_mesh.h"
#include "sim/scene/scene_options.h"

namespace vog {

/// What a scene is made from: its tables of a mission file.
struct SceneSettings {
  SceneOptions scene;
  PropellerOptions propeller;
  TankOptions tank;
  PierOptions pier;
  WreckOptions wreck;
  SeafloorOptions seafloor;
  MineOptions mine;
  std::filesystem::path directory = ".";  ///< Where a relative mesh file is looked for.

  static SceneSettings From(const Config& config);
};

/// The structure that `settings` ask for, in W. @throws UsageError as the generators and LoadMesh()
/// do.
TriangleMesh MakeScene(const SceneSettings& settings);

}  // namespace vog
