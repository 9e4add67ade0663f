#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "lib/base/config.h"
#include "tools/mission/resume.h"

namespace vog {

/// Flies a mission with the real processes and the simulator over LCM, watches over them (a process
/// that dies is started again), records everything, and leaves in `folder` what RunMission()
/// leaves, and the processes' output in output/. `speed` is vehicle time over real time, at most.
/// Returns the metrics.
/// @throws UsageError, SystemError.
nlohmann::ordered_json RunLiveMission(const Config& config, const std::filesystem::path& folder,
                                      double speed, const std::optional<EarlierRun>& earlier = {});

}  // namespace vog
