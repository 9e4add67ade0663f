#pragma once

#include <chrono>
#include <thread>

#include "lib/base/time.h"

namespace vog {

/// Real time since it was made, for progress bars and timing files; no result may depend on it.
class Stopwatch {
 public:
  /// For links, which take any clock that never goes back: from 0 on.
  Time time() const { return Time(FromSeconds(seconds())); }
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Gives the processor away for some milliseconds of real time, while waiting for another process.
inline void WaitBriefly() { std::this_thread::sleep_for(std::chrono::milliseconds(5)); }

}  // namespace vog
