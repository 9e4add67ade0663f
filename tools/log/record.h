#pragma once

#include <string>

#include "lib/bus/lcm_bus.h"
#include "tools/log/log_recorder.h"

namespace vog {

struct RecordOptions {
  RecorderOptions recorder;
  std::string channels = ".*";  ///< As ChannelFilter takes them.
  std::string url = BusOptions().url;
  ClockSource clock = ClockSource::kSystem;
};

/// Records until SIGINT or SIGTERM; returns how many messages.
std::int64_t Record(const RecordOptions& options);

}  // namespace vog
