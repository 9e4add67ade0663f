#pragma once

#include <string>

#include "lib/bus/lcm_bus.h"
#include "tools/log/log_selection.h"

namespace vog {

struct PlayOptions {
  std::string log;
  LogSelection selection;
  double speed = 1;
  bool is_endless = false;
  std::string url = BusOptions().url;
};

/// Publishes a part of a log at its own pace, times `speed`, until its end, SIGINT or SIGTERM. On a
/// terminal it obeys keys.
void PlayLog(const PlayOptions& options);

}  // namespace vog
