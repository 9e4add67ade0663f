#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace vog {

struct McapExport {
  std::int64_t messages = 0;   ///< Of the log.
  std::int64_t malformed = 0;  ///< Those of them that are no messages of their channel's type.
};

/// Writes an LCM event log as an MCAP file with Protobuf messages: what can be drawn under
/// Foxglove's schemas, everything under those of package vogmap (docs/formats.md). The log is read
/// piece by piece; `on_progress` is told the share (0..1) that was read.
/// @throws UsageError as LcmLogReader does, and when `out` is the log; SystemError when `out`
/// cannot be written: what was there stays.
McapExport ExportToMcap(const std::string& log, const std::string& out,
                        const std::function<void(double share)>& on_progress);

}  // namespace vog
