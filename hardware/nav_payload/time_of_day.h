#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "lib/base/time.h"

namespace vog {

/// The time since midnight that "hhmmss" or "hhmmss.sss" says; nothing where it is no such time.
std::optional<Duration> ParseTimeOfDay(std::string_view text);
/// "hhmmss.sss", rounded to a millisecond. @pre 0 <= since_midnight < 24 h.
std::string FormatTimeOfDay(Duration since_midnight);

/// The time of day (UTC) of `time`.
Duration TimeOfDay(Time time);

/// Gives instruments that know no date their time: each time of day is laid where it is at most 2 h
/// before the newest one so far, else on the next day.
class TimeOfDayClock {
 public:
  /// `start` is any moment near the first time of day: at most 2 h behind it, 22 h before it.
  explicit TimeOfDayClock(Time start) : newest_(start) {}

  Time ToTime(Duration since_midnight);

 private:
  Time newest_;
};

}  // namespace vog
