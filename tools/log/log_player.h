#pragma once

#include <functional>
#include <optional>
#include <string>

#include "tools/log/log_selection.h"

namespace vog {

/// Plays a log at a pace of its own. It knows no clock: `wall_s` is real time from anywhere.
class LogPlayer {
 public:
  using Publish = std::function<void(const std::string& channel, Bytes bytes)>;

  /// From the part's start on; `is_endless`: and from there again after its end. @throws UsageError
  /// as SelectedLog does.
  LogPlayer(const std::string& log, const LogSelection& selection, double speed, bool is_endless,
            Publish publish);

  /// Publishes what is due. Returns how long the next one has time, in real seconds; nothing when
  /// that depends on the operator.
  std::optional<double> Play(double wall_s);

  void TogglePause(double wall_s);
  /// Publishes the next message and pauses.
  void StepOne(double wall_s);
  void SetSpeed(double speed, double wall_s);
  /// Jumps by so many seconds of the log.
  void Skip(double by_s, double wall_s);

  bool HasEnded() const { return !next_ && !is_endless_; }
  bool is_paused() const { return is_paused_; }
  double speed() const { return speed_; }
  /// Seconds after the log's first message.
  double PositionAt(double wall_s) const;
  std::int64_t published() const { return published_; }

 private:
  void PublishNext();
  /// Goes on from `position_s` at `wall_s`.
  void Anchor(double position_s, double wall_s);

  SelectedLog log_;
  std::optional<SelectedLog::Event> next_;
  double from_s_, speed_;
  bool is_endless_, is_paused_ = false;
  Publish publish_;
  double anchor_s_, anchor_wall_s_ = 0;
  std::int64_t published_ = 0;
};

}  // namespace vog
