#include "hardware/nav_payload/time_of_day.h"

#include <algorithm>

#include "hardware/nav_payload/text_numbers.h"

namespace vog {
namespace {

constexpr Duration kDay = std::chrono::hours(24);
constexpr Duration kLate = std::chrono::hours(2);

bool IsDigits(std::string_view text) {
  return text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

std::optional<Duration> ParseTimeOfDay(std::string_view text) {
  const std::string_view whole = text.substr(0, text.find('.'));
  if (whole.size() != 6 || !IsDigits(whole)) return std::nullopt;
  const double seconds = ParseNumber(text.substr(4)).value_or(-1);
  if (seconds < 0 || seconds >= 60) return std::nullopt;
  const int hours = ParseInteger(text.substr(0, 2)).value();
  const int minutes = ParseInteger(text.substr(2, 2)).value();
  if (hours > 23 || minutes > 59) return std::nullopt;
  return std::chrono::hours(hours) + std::chrono::minutes(minutes) + FromSeconds(seconds);
}

std::string FormatTimeOfDay(Duration since_midnight) {
  using std::chrono::milliseconds;
  const std::int64_t ms = std::chrono::round<milliseconds>(since_midnight).count() % 86'400'000;
  const std::int64_t hours = ms / 3'600'000, minutes = ms / 60'000 % 60;
  return ToPadded(static_cast<double>(100 * hours + minutes), 0, 4) +
         ToPadded(1e-3 * static_cast<double>(ms % 60'000), 3, 6);
}

Duration TimeOfDay(Time time) {
  return time - std::chrono::floor<std::chrono::duration<std::int64_t, std::ratio<86'400>>>(time);
}

Time TimeOfDayClock::ToTime(Duration since_midnight) {
  Time time = newest_ - TimeOfDay(newest_) + since_midnight;
  if (time < newest_ - kLate) time += kDay;
  if (time >= newest_ - kLate + kDay) time -= kDay;
  newest_ = std::max(newest_, time);
  return time;
}

}  // namespace vog
