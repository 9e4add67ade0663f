#pragma once

#include <cstdint>
#include <deque>

#include "lib/base/time.h"

namespace vog {

/// How many messages come a second, over the last few samples.
class RateMeter {
 public:
  explicit RateMeter(Time began) : samples_{{began, 0}} {}

  void Add() { ++count_; }
  void Sample(Time now);
  double rate_hz() const;
  std::int64_t count() const { return count_; }

 private:
  struct Counted {
    Time time;
    std::int64_t count;
  };

  std::deque<Counted> samples_;
  std::int64_t count_ = 0;
};

}  // namespace vog
