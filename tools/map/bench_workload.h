#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "lib/occupancy/occupancy_map.h"
#include "tools/map/bench_scene.h"

namespace vog {

using PosesWM = std::vector<std::pair<SubmapId, Pose3>>;

struct BenchRay {
  Vec3 origin_W = Vec3::Zero(), direction_W = Vec3::UnitX();
};

/// Rays from one place.
struct BenchView {
  Vec3 origin_W = Vec3::Zero();
  std::vector<Vec3> directions_W;
};

/// A planning step: this many views of so many rays.
inline constexpr int kStepViews = 15, kViewRays = 96;
inline constexpr double kRayLength_m = 5;

/// What all methods are asked on one map, so that they can be compared.
struct BenchWorkload {
  std::vector<VoxelKey> known_voxels;  ///< Seen by a submap at least; in random order.
  std::vector<BenchRay> rays;          ///< From free places, in all directions.
  std::vector<BenchView> step_views;   ///< Of a planning step.
  std::vector<Waypoint> poses;         ///< Free or not.
};

/// @pre `submaps` is not empty.
BenchWorkload MakeWorkload(const BenchScene& scene, std::span<const BenchSubmap> submaps);

/// `count` centres of voxels that the submap knows, each drawn for itself. @pre it knows some.
std::vector<Vec3> KnownPlaces_M(const BrickGrid& grid, int count, Random& random);

/// The poses of `count` submaps, spread over all, after a small correction; another one for each
/// `round`.
PosesWM CorrectedPoses(const BenchScene& scene, std::span<const BenchSubmap> submaps, int count,
                       int round);

/// Mean number of submaps that know a voxel of `voxels`.
double OverlapAt(std::span<const BenchSubmap> submaps, const VoxelGrid& grid,
                 std::span<const VoxelKey> voxels);

/// How many unknown voxels the views see, as the planner asks for them.
std::size_t CountUnknown(const OccupancyMap& map, std::span<const BenchView> views);

}  // namespace vog
