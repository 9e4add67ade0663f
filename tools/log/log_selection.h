#pragma once

#include <limits>
#include <optional>
#include <string>

#include "lib/bus/lcm_log.h"
#include "tools/log/channel_filter.h"

namespace vog {

/// Which part of a log is meant. Times are seconds after its first message.
struct LogSelection {
  std::string channels = ".*";  ///< As ChannelFilter takes them.
  double from_s = 0;
  double to_s = std::numeric_limits<double>::infinity();
};

/// Reads the part of a log that is meant.
class SelectedLog {
 public:
  /// @throws UsageError as LcmLogReader and ChannelFilter do, and for a part without a message.
  SelectedLog(const std::string& path, const LogSelection& selection);

  struct Event {
    double at_s;  ///< After the log's first message.
    LogEvent event;
  };
  /// Nothing at the end.
  std::optional<Event> Next();
  /// The next one will be the first not before `at_s`, nor before the part's start.
  void SeekTo(double at_s);

 private:
  ChannelFilter filter_;
  LcmLogReader reader_;
  LogSelection selection_;
  Time first_;
};

}  // namespace vog
