#pragma once

#include <chrono>
#include <cstdint>

namespace vog {

/// Tag of the vehicle's time. It cannot be read: a Time reaches the code only inside a message or
/// as a handler's argument, so that a replay sees what the vehicle saw.
struct VehicleClock {
  using rep = std::int64_t;
  using period = std::micro;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<VehicleClock>;
  static constexpr bool is_steady = true;
};

using Duration = VehicleClock::duration;
using Time = VehicleClock::time_point;

/// The `utime_us` that messages and logs carry.
constexpr std::int64_t ToUtime(Time time) { return time.time_since_epoch().count(); }
constexpr Time FromUtime(std::int64_t utime_us) { return Time(Duration(utime_us)); }

/// Whether it is a time that a vehicle's clock can show: bytes that make no sense seldom are.
constexpr bool IsUtime(std::int64_t utime_us) {
  constexpr std::int64_t kYear2100_us = 4'102'444'800'000'000;
  return utime_us >= 0 && utime_us < kYear2100_us;
}

constexpr double ToSeconds(Duration duration) {
  return 1e-6 * static_cast<double>(duration.count());
}
constexpr double ToSeconds(Time time) { return ToSeconds(time.time_since_epoch()); }

/// Rounded to the nearest microsecond.
constexpr Duration FromSeconds(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e6 + (seconds < 0 ? -0.5 : 0.5)));
}

}  // namespace vog
