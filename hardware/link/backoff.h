#pragma once

#include <algorithm>

#include "lib/base/time.h"

namespace vog {

/// When to try again: 10 ms after the first failure, then twice as long each time, up to 5 s.
class Backoff {
 public:
  bool IsDue(Time now) const { return now >= next_; }

  void Fail(Time now) {
    next_ = now + delay_;
    delay_ = std::min(2 * delay_, kLongest);
  }

  /// After a success: a failure soon after it is tried again soon.
  void Reset() { *this = Backoff(); }

 private:
  static constexpr Duration kShortest = std::chrono::milliseconds(10);
  static constexpr Duration kLongest = std::chrono::seconds(5);

  Time next_ = Time::min();
  Duration delay_ = kShortest;
};

}  // namespace vog
