#pragma once

#include <cmath>
#include <vector>

#include "lib/occupancy/grid_map_testing.h"
#include "lib/planner/planner_options.h"
#include "lib/scan/sonar.h"

/// A small world to explore in tests.
namespace vog {

constexpr double kChamberVoxel_m = 0.2;

/// A sonar with few beams and a wide sweep.
inline SonarOptions WideSonar() {
  SonarOptions sonar;
  sonar.fov_deg = 60;
  sonar.min_range_m = 0.2;
  sonar.max_range_m = 5;
  sonar.mount_m = {0.1, 0, 0};
  return sonar;
}

/// One that sweeps so fast that the vehicle may turn on while it looks.
inline SonarOptions NarrowSonar() {
  SonarOptions sonar = WideSonar();
  sonar.fov_deg = 30;
  sonar.tilt_rate_deg_s = 40;
  return sonar;
}

inline PlannerOptions SmallPlanner() {
  PlannerOptions options;
  options.hull_size_m = {0.6, 0.6, 0.4};
  options.clearance_m = 0.1;
  options.unknown_clearance_m = 0;
  options.range_m = 4;
  options.ray_step_deg = 5;
  options.zero_gain_voxels = 30;
  options.bubble_radius_m = 0.9;
  options.max_edge_m = 1.5;
  return options;
}

/// A closed room of 7 x 5 x 2.4 m around the origin with a pillar, as voxels: the truth.
inline GridMap Chamber() {
  GridMap truth(kChamberVoxel_m);
  truth.Fill({{-18, -13, -7}, {17, 12, 6}}, GridMap::kOccupied);
  truth.Fill({{-17, -12, -6}, {16, 11, 5}}, GridMap::kFree);
  truth.Fill({{4, -2, -6}, {6, 1, 5}}, GridMap::kOccupied);
  return truth;
}

inline Eigen::AlignedBox3d ChamberBox() { return {Vec3(-3.4, -2.4, -1.2), Vec3(3.4, 2.4, 1.2)}; }

/// Adds to `map` what a whole sweep sees of `truth`.
inline void Look(const GridMap& truth, const SonarOptions& sonar, const Pose3& X_WB, GridMap& map) {
  for (double tilt_deg = -sonar.tilt_amplitude_deg; tilt_deg <= sonar.tilt_amplitude_deg;
       tilt_deg += 2) {
    const Pose3 X_WS = X_WB * SonarPose(sonar, ToRadians(tilt_deg));
    for (double bearing_deg = -sonar.fov_deg / 2; bearing_deg <= sonar.fov_deg / 2;
         bearing_deg += 2)
      WalkVoxels(truth.grid(), X_WS.translation(),
                 X_WS.linear() * BeamDirection(ToRadians(bearing_deg)), sonar.max_range_m,
                 [&](const VoxelKey& key, double) {
                   map.Set(key, truth.Get(key));
                   return !truth.IsOccupied(truth.Get(key));
                 });
  }
}

}  // namespace vog
