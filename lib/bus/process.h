#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "lib/base/config.h"
#include "lib/bus/lcm_bus.h"

namespace vog {

/// What each process of the system is given: `--config FILE`, `--set table.key=value`, and on top
/// of those the tables that it reads itself.
struct ProcessDescription {
  const char* name;     ///< vog-slam
  const char* purpose;  ///< One line for --help.
  /// Where the process itself is the source of the vehicle's time, whatever bus.clock says.
  bool is_time_source = false;
  /// Whether several may serve one bus: they only listen.
  bool may_be_many = false;
};

/// Runs a process from its arguments to its end: reads the configuration, opens the bus, lets
/// `start` make the node, and handles messages until SIGINT or SIGTERM. Returns the exit status; 1
/// where one of the same name serves the same bus on this machine, whose words and its own would be
/// mixed.
/// `start(bus, config)` returns whatever must live as long as the process, as a shared_ptr<void>.
int RunProcess(const ProcessDescription& description, int argc, char** argv,
               const std::function<std::shared_ptr<void>(LcmBus&, const Config&)>& start);

/// Becomes true with SIGINT or SIGTERM, from the first call on.
const std::atomic<bool>& StopSignal();

}  // namespace vog
