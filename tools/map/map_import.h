#pragma once

#include <filesystem>

#include "lib/submap/submap_builder.h"
#include "lib/vogmap/map_folder.h"

namespace vog {

/// What recorded clouds tell of the space between the sensor and their points.
enum class FreeSpace {
  kNone,  ///< Nothing: clouds gathered on the move do not say from where each point was seen.
  kRays,  ///< Free along the straight lines from the cloud's viewpoint.
};

struct ImportOptions {
  SubmapOptions submap;
  SensorModelOptions sensor_model;
  FreeSpace free_space = FreeSpace::kNone;
  bool z_down = false;      ///< Poses and points have z down (NED and FRD): turned to ours.
  double sigma_xy_m = 0.2;  ///< Assumed of the motion between two clouds.
  double sigma_yaw_rad = 0.02;
};

/// Each .pcd of a folder, in the order of their numbers or names, becomes a submap at its
/// VIEWPOINT.
/// @throws UsageError naming the file that cannot be read; for a folder without .pcd files.
StoredMap ImportClouds(const std::filesystem::path& folder, const ImportOptions& options);

/// An OctoMap .graph scan log: as many scans as `submap.scans_per_submap` make a submap, with free
/// space along their rays. @throws UsageError.
StoredMap ImportScanGraph(const std::filesystem::path& file, const ImportOptions& options);

/// An OctoMap octree (.ot, or .bt, whose voxels get the sensor model's clamps) becomes one submap
/// at the origin, with the octree's own voxel size. @throws UsageError naming the file.
StoredMap ImportOctree(const std::filesystem::path& file, const ImportOptions& options);

}  // namespace vog
