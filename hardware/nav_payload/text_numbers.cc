#include "hardware/nav_payload/text_numbers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace vog {
namespace {

constexpr double kLargest = 1e10;

std::string_view Trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

template <class Number>
std::optional<Number> Parse(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> ParseNumber(std::string_view text) {
  const auto value = Parse<double>(text);
  if (!value || !std::isfinite(*value) || std::abs(*value) > kLargest) return std::nullopt;
  return value;
}

std::optional<int> ParseInteger(std::string_view text) { return Parse<int>(text); }

std::string ToFixed(double value, int decimals) {
  std::array<char, 64> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value,
                                          std::chars_format::fixed, decimals);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}

std::string ToPadded(double value, int decimals, std::size_t width) {
  const std::string text = ToFixed(value, decimals);
  return text.size() < width ? std::string(width - text.size(), '0') + text : text;
}

std::string ToSigned(double value, int decimals) {
  const std::string text = ToFixed(value, decimals);
  return text.starts_with('-') ? text : "+" + text;
}

std::vector<std::string> SplitFields(std::string_view text, char separator) {
  std::vector<std::string> fields;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    fields.emplace_back(Trim(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

}  // namespace vog
