#pragma once

#include <string>

#include "lib/bus/lcm_bus.h"

namespace vog {

struct StatusOptions {
  std::string url = BusOptions().url;
  bool once = false;  ///< Listen for two seconds, show, and end.
  bool json = false;  ///< A line of JSON each time.
};

/// Shows how the system is, once a second until SIGINT or SIGTERM: in place on a terminal, one
/// after the other elsewhere. @throws SystemError when `once` and nothing is heard.
void ShowStatus(const StatusOptions& options);

}  // namespace vog
