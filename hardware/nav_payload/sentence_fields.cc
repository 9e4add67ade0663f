#include "hardware/nav_payload/sentence_fields.h"

#include <algorithm>
#include <cmath>

#include "hardware/nav_payload/text_numbers.h"
#include "hardware/nav_payload/time_of_day.h"
#include "lib/geometry/pose.h"

namespace vog {
namespace {

constexpr double kLatestUnixSeconds = 4e9;

/// Without what would end a field or the sentence.
std::string Harmless(std::string text, bool may_have_commas) {
  std::replace_if(
      text.begin(), text.end(),
      [&](char c) {
        return c < ' ' || c > '~' || c == '$' || c == '*' || (c == ',' && !may_have_commas);
      },
      ' ');
  return text;
}

}  // namespace

void SentenceFields::Exchange(std::string& text) {
  if (!is_reading_) {
    fields_.push_back(Harmless(text, false));
  } else if (next_ < fields_.size()) {
    text = fields_[next_++];
  } else {
    is_short_ = true;
  }
}

void SentenceFields::Rest(std::string& value) {
  if (!is_reading_) {
    fields_.push_back(Harmless(value, true));
    return;
  }
  Exchange(value);
  while (next_ < fields_.size()) value += "," + fields_[next_++];
}

void SentenceFields::TimeOfDay(Duration& since_midnight) {
  std::string text = FormatTimeOfDay(since_midnight);
  Exchange(text);
  const auto parsed = ParseTimeOfDay(text);
  has_bad_field_ |= !parsed;
  since_midnight = parsed.value_or(Duration{});
}

void SentenceFields::UnixSeconds(Time& time) {
  double seconds = ToSeconds(time);
  Number(seconds, 6);
  has_bad_field_ |= seconds < 0 || seconds > kLatestUnixSeconds;
  if (!has_bad_field_) time = Time(FromSeconds(seconds));
}

void SentenceFields::Number(std::optional<double>& value, int decimals) {
  std::string text = value ? ToFixed(*value, decimals) : "";
  Exchange(text);
  value = ParseNumber(text);
  has_bad_field_ |= !value && !text.empty();
}

void SentenceFields::Number(double& value, int decimals) {
  std::optional<double> number = value;
  Number(number, decimals);
  has_bad_field_ |= !number;
  value = number.value_or(0);
}

void SentenceFields::Degrees(std::optional<double>& angle_rad, int decimals) {
  if (angle_rad) angle_rad = ToDegrees(*angle_rad);
  Number(angle_rad, decimals);
  if (angle_rad) angle_rad = ToRadians(*angle_rad);
}

void SentenceFields::Degrees(double& angle_rad, int decimals) {
  double deg = ToDegrees(angle_rad);
  Number(deg, decimals);
  angle_rad = ToRadians(deg);
}

void SentenceFields::Integer(int& value) {
  std::string text = std::to_string(value);
  Exchange(text);
  const auto parsed = ParseInteger(text);
  has_bad_field_ |= !parsed;
  value = parsed.value_or(0);
}

void SentenceFields::Choice(bool& value, const std::string& if_true, const std::string& if_false) {
  std::string text = value ? if_true : if_false;
  Exchange(text);
  has_bad_field_ |= text != if_true && text != if_false;
  value = text == if_true;
}

void SentenceFields::Geographic(std::optional<double>& angle_rad, int degree_digits,
                                const std::string& positive, const std::string& negative) {
  constexpr int kDecimals = 6;
  // Rounded before it is split, so that 59.9999999 minutes become the next degree.
  const double micro_minutes = std::round(std::abs(ToDegrees(angle_rad.value_or(0))) * 60e6);
  const double whole_deg = std::floor(micro_minutes / 60e6);
  std::string text, half;
  if (angle_rad) {
    const double value = 100 * whole_deg + 1e-6 * (micro_minutes - 60e6 * whole_deg);
    text = ToPadded(value, kDecimals, degree_digits + 3 + kDecimals);
    half = *angle_rad < 0 ? negative : positive;
  }
  Exchange(text);
  Exchange(half);
  angle_rad.reset();
  if (text.empty() && half.empty()) return;
  const double value = ParseNumber(text).value_or(-1);
  const double deg = std::floor(value / 100), minutes = value - 100 * deg;
  has_bad_field_ |= value < 0 || deg > (degree_digits == 2 ? 90 : 180) || minutes >= 60 ||
                    (half != positive && half != negative);
  angle_rad = ToRadians((deg + minutes / 60) * (half == negative ? -1 : 1));
}

}  // namespace vog
