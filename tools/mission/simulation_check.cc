#include "tools/mission/simulation_check.h"

#include <array>
#include <cstdio>

#include "lib/geometry/voxel_grid.h"
#include "lib/planner/planner_options.h"
#include "procs/nav_bridge/nav_bridge_node.h"
#include "tools/mission/hull_space.h"

namespace vog {
namespace {

constexpr double kLattice_m = 0.25;

std::string Describe(const Eigen::AlignedBox3d& box_W) {
  std::array<char, 160> text;
  const Vec3 &lo = box_W.min(), &hi = box_W.max();
  std::snprintf(text.data(), text.size(), "(%g, %g, %g) to (%g, %g, %g)", lo.x(), lo.y(), lo.z(),
                hi.x(), hi.y(), hi.z());
  return text.data();
}

bool FitsSomewhere(const HullSpace& space, const Eigen::AlignedBox3d& box_W) {
  const Eigen::Array3i steps =
      (box_W.sizes() / kLattice_m).array().floor().cwiseMin(1e4).cast<int>();
  for (int x = 0; x <= steps.x(); ++x)
    for (int y = 0; y <= steps.y(); ++y)
      for (int z = 0; z <= steps.z(); ++z)
        if (space.Fits(box_W.min() + kLattice_m * Vec3(x, y, z))) return true;
  return false;
}

/// Without, there would never be any navigation.
void RejectDeafBridge(const Config& config, NavigationKind simulated) {
  const bool hears_instruments =
      config.Read<NavBridgeOptions>("navigation").source == NavigationSource::kInstruments;
  if (hears_instruments == (simulated == NavigationKind::kSensors)) return;
  throw UsageError(
      hears_instruments
          ? "navigation.source = \"instruments\" needs simulation.navigation = \"sensors\""
          : "simulation.navigation = \"sensors\" needs navigation.source = "
            "\"instruments\"");
}

}  // namespace

SimSettings CheckedSimSettings(const Config& config) {
  SimSettings settings = SimSettings::From(config);
  RejectDeafBridge(config, settings.world.simulation.navigation);
  const Eigen::AlignedBox3d box_W = config.Read<ExplorationOptions>("exploration").box_W();
  const HullSpace space(settings.scene_W, settings.world.vehicle.hull_size_m);
  if (!FitsSomewhere(space, box_W))
    throw UsageError("the vehicle fits nowhere into the exploration box " + Describe(box_W) +
                     ": set exploration.min_m and exploration.max_m");
  if (!box_W.contains(settings.world.simulation.start_position_m))
    throw UsageError("the vehicle would start outside of the exploration box " + Describe(box_W) +
                     ": set simulation.start_position_m, or the box");
  const World start(settings.world, settings.scene_W);  // Throws when it starts in an obstacle.
  return settings;
}

}  // namespace vog
