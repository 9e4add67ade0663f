#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "lib/base/config.h"
#include "lib/vogmap/map_folder.h"

namespace vog {

struct EvaluationOptions {
  double surface_spacing_m = 0.1;
  double surface_tolerance_m = 0.1;
  double reach_step_m = 0.4;
  int min_neighbours = 3;

  void Visit(OptionsVisitor& v) {
    v("surface_spacing_m", surface_spacing_m, Between(0.01, 10), "between samples of the surface");
    v("surface_tolerance_m", surface_tolerance_m, Between(0.001, 10),
      "a sample is seen when a true end point is this near");
    v("reach_step_m", reach_step_m, Between(0.05, 10),
      "lattice of places in which the vehicle's reach is flooded");
    v("min_neighbours", min_neighbours, Between(0, 26),
      "occupied voxels with fewer occupied neighbours are left out of every cloud");
  }
};

/// Judges the finished run in `folder` (lcm.log and map/) against the truth, and writes beside
/// them: metrics.json, timeseries.json, truth.tum, odometry.tum, estimate.tum, submap_places.csv
/// and reconstruction_{truth,vog,vog_no_lc,standard}.ply. Returns the metrics. What each number
/// means: docs/evaluation.md. @throws UsageError for a folder that holds no simulated run.
nlohmann::ordered_json EvaluateRun(const std::filesystem::path& folder);

/// Judges another map of the same run, as other settings of SLAM make it from the run's submaps:
/// rmse_m, position_error_m, nees_per_dimension and nees_share_below_95 as above. Writes nothing.
/// @pre `map` has the submaps of the run's. @throws UsageError for a folder that holds no simulated
/// run.
nlohmann::ordered_json JudgeMap(const std::filesystem::path& folder, const StoredMap& map);

}  // namespace vog
