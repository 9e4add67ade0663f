#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/geometry/odometry.h"
#include "lib/geometry/trajectory.h"
#include "lib/messages/convert.h"
#include "lib/scan/scan.h"

namespace vog {

/// A scan of a run, with all that is known of its place.
struct RunScan {
  Scan scan;
  OdometrySample odometry;
  Pose3 X_WB_true = Pose3::Identity();
};

/// A finished run, read back from its log.
struct RunRecord {
  Config config;
  std::string mode;
  std::int64_t seed = 0;
  std::int64_t run_id = 0;
  std::vector<RunScan> scans;  ///< In order of time; those with odometry and truth.
  Trajectory truth;            ///< Everything the simulator told.
  std::vector<Time> begins;    ///< Of its flights, more than one if it went on from another run.
  double end_time_s = 0;
  std::string end_reason;
  bool is_home = false;
  std::int64_t unseen_voxels = 0, unseen_in_vain = 0;  ///< As in MISSION_STATUS.
  std::vector<SubmapPlace> places;                     ///< Of the newest solution.
  int full_closures = 0, partial_closures = 0, rejected_closures = 0;
};

/// Reads what a simulated run's log holds. @throws UsageError when the log has no RUN or no TRUTH:
/// it is not one of a simulated run.
RunRecord ReadRun(const std::filesystem::path& log);

/// The same of the log in a run's folder, with the scans and the truth of the runs it went on from,
/// as far as their logs are kept there.
RunRecord ReadFlights(const std::filesystem::path& folder);

}  // namespace vog
