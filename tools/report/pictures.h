#pragma once

#include <string>

#include "tools/report/run_folder.h"

namespace vog {

/// The points (time, value) of a series of timeseries.json, none where it is missing.
std::vector<std::pair<double, double>> SeriesPoints(const nlohmann::ordered_json& series,
                                                    const std::string& key);

/// A planner step that gave a plan.
struct PlanningStep {
  double submaps, wall_ms;
};

/// Those of timing.json, none where they are missing.
std::vector<PlanningStep> PlanningSteps(const nlohmann::ordered_json& timing);

/// Over the number of submaps the median of the steps' wall times [ms].
std::vector<std::pair<double, double>> MedianSteps(const std::vector<PlanningStep>& steps);

// Parts of a run's page, as HTML. Each says so where the run has not got what it needs.

/// Truth, odometry and estimate over the scene, from above and from the side.
std::string PathsHtml(const RunFolder& run);

/// Over time: the share of surface and volume seen, and how far odometry and estimate are off.
std::string ProgressHtml(const RunFolder& run);

/// Wall time of each planning step over the number of submaps, and of each node.
std::string TimingHtml(const RunFolder& run);

/// The nodes at their final poses and the edges between them, from above; why closures were
/// rejected.
std::string PoseGraphHtml(const RunFolder& run);

/// Each loop closure that was tried: the accepted ones, those dropped later too, with both submaps
/// before and after their registration, and folded the rejected ones.
std::string LoopClosuresHtml(const RunFolder& run);

/// Whether the submaps' errors are as large as their covariances say, submap by submap.
std::string ConsistencyHtml(const RunFolder& run);

/// The merged map: projected from above, with and without closures [Ho et al. 2018, Fig. 10 and
/// 11], and from the side, and a horizontal slice.
std::string OccupancyHtml(const RunFolder& run);

/// Reads the folder's reconstructions and colours them by their distance from the true one.
std::string ReconstructionHtml(const std::filesystem::path& folder, double voxel_size_m);

}  // namespace vog
