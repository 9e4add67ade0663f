#pragma once

#include <filesystem>
#include <limits>
#include <optional>

#include "tools/mission/lock_step.h"

namespace vog {

/// Feeds the vehicle's channels of a log (RUN, the instruments, the sonar, TRUTH) to all nodes in
/// lock step, in the log's own time, and leaves in `folder` what RunMission() leaves: everything
/// the nodes say is computed anew. A log of a lock-step mission gives that mission's map, byte for
/// byte. A log that breaks off gives the map of what there is. A run that went on from another one
/// needs that one: `resume`, or the one kept beside the log. @throws UsageError when the log has no
/// RUN message or the earlier run is missing.
void ReplayLog(const std::filesystem::path& log, const std::filesystem::path& folder,
               const std::optional<std::string>& resume = {});

/// Leaves only the map, in `map_folder`. The log may also hold SCAN and NAV instead of the
/// vehicle's channels.
/// @throws UsageError when there is nothing to build a map from.
void BuildMapFromLog(const std::filesystem::path& log, const Config& config,
                     const std::filesystem::path& map_folder);

/// The first RUN message among the first `max_events` of a log.
std::optional<run_t> FirstRun(const std::filesystem::path& log,
                              int max_events = std::numeric_limits<int>::max());

/// Reads the configuration of the run that a log holds. @throws UsageError without a RUN message.
Config ConfigOfLog(const std::filesystem::path& log);

}  // namespace vog
