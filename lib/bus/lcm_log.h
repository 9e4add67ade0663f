#pragma once

#include <cstdint>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lib/bus/bus.h"

namespace vog {

struct LogEvent {
  Time time;
  std::string channel;
  std::vector<std::uint8_t> bytes;
  bool operator==(const LogEvent&) const = default;
};

/// Reads an LCM event log.
class LcmLogReader {
 public:
  /// @throws UsageError when there is no such file, or it is no LCM event log. An empty one is.
  explicit LcmLogReader(const std::string& path);
  LcmLogReader(const LcmLogReader&) = delete;
  LcmLogReader& operator=(const LcmLogReader&) = delete;

  /// The next event, nothing at the end. Damaged events are passed over, and so is one that a
  /// damaged event's head follows: LCM trusts no event without a good neighbour.
  std::optional<LogEvent> Next();
  /// The next event will be the first one that is not before `time`. @pre the log is in the order
  /// of time.
  void SeekTo(Time time);

 private:
  std::optional<LogEvent> Read();

  std::optional<LogEvent> next_;  // Already read.
  lcm::LogFile file_;
};

/// Writes an LCM event log.
class LcmLogWriter {
 public:
  /// @throws SystemError when the file cannot be made.
  explicit LcmLogWriter(const std::string& path);
  LcmLogWriter(const LcmLogWriter&) = delete;
  LcmLogWriter& operator=(const LcmLogWriter&) = delete;

  /// @throws SystemError when the disk is full.
  void Write(Time time, const std::string& channel, Bytes bytes);
  /// Hands all to the system, so that it outlives this program. @throws SystemError likewise.
  void Flush();
  /// Of the file, with what is not flushed yet.
  std::uintmax_t size_bytes();

 private:
  [[noreturn]] void FailToWrite() const;

  std::string path_;
  lcm::LogFile file_;
};

}  // namespace vog
