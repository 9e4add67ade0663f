#pragma once

#include <memory>
#include <vector>

#include "lib/registration/clouds_testing.h"
#include "lib/submap/submap.h"

/// Submaps for tests.
namespace vog {

constexpr LogOddsUnits kOccupiedUnits = 40;

/// A room of 10 x 8 m without any symmetry.
inline std::vector<Rectangle> FurnishedRoom() {
  return {{{5, -4, -1}, {0, 8, 0}, {0, 0, 2}},        {{-5, -4, -1}, {0, 8, 0}, {0, 0, 2}},
          {{-5, 4, -1}, {10, 0, 0}, {0, 0, 2}},       {{-5, -4, -1}, {10, 0, 0}, {0, 0, 2}},
          {{4, 1, -1}, {0, 0.8, 0}, {0, 0, 1.4}},     {{4, 1, -1}, {1, 0, 0}, {0, 0, 1.4}},
          {{-3, 3, -1}, {0, 1, 0}, {0, 0, 2}},        {{-3, 3, -1}, {-1.2, 0, 0}, {0, 0, 2}},
          {{-4.2, -2, -1}, {0, 1.3, 0}, {0, 0, 1.6}}, {{-4.2, -2, -1}, {-0.8, 0, 0}, {0, 0, 1.6}},
          {{1, -3, -1}, {1.7, 0.4, 0}, {0, 0, 1.2}}};
}

/// Of a pose whose height, roll and pitch are known well.
inline Mat6 PlanarCovariance(double sigma_m, double sigma_yaw_rad) {
  return Twist(sigma_m * sigma_m, sigma_m * sigma_m, 1e-4, 1e-5, 1e-5,
               sigma_yaw_rad * sigma_yaw_rad)
      .asDiagonal();
}

/// A grid whose occupied voxels are those around `points_M`.
inline BrickGrid GridOf(const std::vector<Vec3>& points_M, double voxel_size_m = 0.095) {
  BrickGrid grid(voxel_size_m);
  for (const Vec3& p : points_M) grid.At(grid.grid().KeyOf(p)) = kOccupiedUnits;
  return grid;
}

/// The surfaces of `structure_W` within `range_m` of the base, seen with a little noise.
inline std::shared_ptr<Submap> SubmapOf(SubmapId id, const std::vector<Rectangle>& structure_W,
                                        const Pose3& X_WM, double range_m = 5) {
  const Random random(static_cast<std::uint64_t>(id) + 1, "submap");
  std::vector<Vec3> points_M;
  for (const Vec3& p_W : SampleRectangles(structure_W, 0.07, random)) {
    const Vec3 p_M = X_WM.inverse() * p_W;
    if (p_M.norm() < range_m) points_M.push_back(p_M);
  }
  auto submap = std::make_shared<Submap>(Submap{.base = {},
                                                .first_scan = {},
                                                .last_scan = {},
                                                .grid = GridOf(WithNoise(points_M, 0.01, random))});
  submap->base.id = id;
  submap->base.odometry.X_OB = X_WM;
  return submap;
}

}  // namespace vog
