#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lib/slam/slam.h"
#include "lib/vogmap/map_folder.h"

namespace vog {

/// Wrong registrations on purpose, to see whether SLAM notices: a share of those that could be used
/// is shifted and turned by as much as the limits say.
struct FaultOptions {
  double share = 0;
  double least_shift_m = 0.5, most_shift_m = 2;
  double least_turn_deg = 10, most_turn_deg = 60;
  /// The same wrong motion for this many registrations in a row, as neighbours agree with each
  /// other when they all mistake one place for another.
  int group = 1;
  std::uint64_t seed = 1;
};

/// What SLAM did with a map's submaps.
struct RerunSummary {
  int full = 0, partial = 0;            ///< Closures that are in the graph at the end.
  std::map<std::string, int> rejected;  ///< How many for each reason.
  int faults = 0;                       ///< Registrations that were made wrong,
  int faults_kept = 0;                  ///< and those of them that are in the graph at the end.
  double median_s = 0, worst_s = 0;     ///< Real time a submap.
  double last_tenth_median_s = 0;       ///< The same of those that saw most others.
};

/// A map whose poses and graph are SLAM's, made anew from the submaps and their odometry, one after
/// the other as in a mission. Calls `show(share done)` now and then.
/// @throws UsageError when submaps are missing between the first and the last.
struct Rerun {
  StoredMap map;
  /// The nodes of the graph X_WC, in the order of the submaps. Covariances are those of the body's
  /// poses there relative to the first, right perturbation; none when the graph does not determine
  /// all poses.
  std::vector<Pose3> X_WC;
  std::vector<Mat6> covariances;
  std::map<SubmapId, double> revisits;  ///< What seeing submaps again would gain now.
  RerunSummary summary;
};
Rerun RerunSlam(const StoredMap& map, const SlamSettings& settings, const FaultOptions& faults,
                const std::function<void(double)>& show);

}  // namespace vog
