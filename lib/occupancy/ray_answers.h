#pragma once

#include <vector>

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// The places along a ray that were asked, and the answers, up to the first occupied one.
struct RayAnswers {
  std::vector<Vec3> points_W;
  std::vector<float> log_odds;
};

/// Answers at the centres of the voxels that the ray crosses (`cached`). @pre direction_W is a unit
/// vector.
RayAnswers AnswersInVoxels(const OccupancyMap& map, const Vec3& origin_W, const Vec3& direction_W,
                           double range_m);

/// Answers at points a voxel's side apart, the first that far from the origin (`direct` and the
/// baselines). @pre direction_W is a unit vector.
RayAnswers AnswersAtSteps(const OccupancyMap& map, const Vec3& origin_W, const Vec3& direction_W,
                          double range_m);

}  // namespace vog
