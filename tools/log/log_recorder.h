#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>

#include "lib/bus/lcm_log.h"

namespace vog {

struct RecorderOptions {
  std::filesystem::path file;
  std::uintmax_t max_bytes = 0;  ///< Of FILE.000, FILE.001 ...; 0: one FILE of any size.
  int keep = 0;                  ///< So many of those; older ones are removed. 0: all.
};

/// Writes messages to log files. When the disk is full it leaves out messages until there is room
/// again, for which it removes the oldest of several files if `keep` says that old ones may go. It
/// never throws for that.
class LogRecorder {
 public:
  /// Goes on after the numbers that are there. @throws UsageError when FILE itself is there,
  /// SystemError when it cannot be made.
  explicit LogRecorder(RecorderOptions options);
  ~LogRecorder();
  LogRecorder(const LogRecorder&) = delete;
  LogRecorder& operator=(const LogRecorder&) = delete;

  void Write(Time time, const std::string& channel, Bytes bytes);
  /// Hands all to the system, and tries again after a full disk; to be called once a second.
  void Tick();

  std::int64_t written() const { return written_; }
  std::int64_t lost() const { return lost_; }

 private:
  bool IsRotating() const { return options_.max_bytes > 0; }
  void FindFiles();
  std::filesystem::path NextPath() const;
  void Open();
  void RemoveOldest();
  void Flush();
  void OnFull(const std::string& why);
  bool HasRoom() const;
  void TryAgain();

  RecorderOptions options_;
  std::deque<std::filesystem::path> files_;  // The newest last.
  int next_number_ = 0;
  std::optional<LcmLogWriter> writer_;
  std::uintmax_t flushed_bytes_ = 0;
  std::int64_t written_ = 0, lost_ = 0, unflushed_ = 0;
};

}  // namespace vog
