#include "hardware/frames/candump.h"

#include <charconv>
#include <cstdio>

namespace vog {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;
constexpr std::int64_t kMicrosecondsPerSecond = 1'000'000;

template <class Number>
std::optional<Number> ReadNumber(std::string_view text, int base) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// What stands before `separator`, which is taken away with it.
std::optional<std::string_view> Take(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view head = text.substr(0, end);
  text.remove_prefix(end + 1);
  return head;
}

/// "1436509052.249713"
std::optional<Time> ReadTime(std::string_view text) {
  const auto whole = Take(text, '.');
  if (!whole || text.size() != 6) return std::nullopt;
  const auto seconds = ReadNumber<std::uint32_t>(*whole, 10);
  const auto microseconds = ReadNumber<std::uint32_t>(text, 10);
  if (!seconds || !microseconds) return std::nullopt;
  return FromUtime(*seconds * kMicrosecondsPerSecond + *microseconds);
}

bool ReadId(std::string_view text, CanFrame& frame) {
  const auto id = ReadNumber<std::uint32_t>(text, 16);
  if (!id || (text.size() != 3 && text.size() != 8)) return false;
  frame.error = text.size() == 8 && (*id & kErrorFlag) != 0;
  frame.extended = text.size() == 8 && !frame.error;
  frame.id = frame.error ? *id & ~kErrorFlag : *id;
  return frame.id <= (text.size() == 3 ? kMaxStandardId : kMaxExtendedId);
}

bool ReadData(std::string_view text, CanFrame& frame) {
  if (text.size() % 2 != 0 || text.size() / 2 > (frame.fd ? kMaxFdSize : kMaxClassicSize))
    return false;
  frame.size = static_cast<std::uint8_t>(text.size() / 2);
  for (std::size_t i = 0; i < frame.size; ++i) {
    const auto byte = ReadNumber<std::uint8_t>(text.substr(2 * i, 2), 16);
    if (!byte) return false;
    frame.data[i] = *byte;
  }
  return true;
}

bool ReadRemote(std::string_view text, CanFrame& frame) {
  frame.remote = true;
  if (text.empty()) return true;
  const auto size = ReadNumber<std::uint8_t>(text, 10);
  frame.size = size.value_or(0);
  return size && *size <= kMaxClassicSize;
}

bool ReadFd(std::string_view text, CanFrame& frame) {
  const auto flags = ReadNumber<std::uint8_t>(text.substr(0, 1), 16);
  frame.fd = true;
  frame.fd_flags = flags.value_or(0);
  return flags && ReadData(text.substr(1), frame);
}

bool ReadContent(std::string_view text, CanFrame& frame) {
  if (text.starts_with('#')) return ReadFd(text.substr(1), frame);
  if (text.starts_with('R')) return ReadRemote(text.substr(1), frame);
  return ReadData(text, frame);
}

std::string Hex(std::uint32_t value, int digits) {
  char text[9];
  std::snprintf(text, sizeof text, "%0*X", digits, value);
  return text;
}

std::string FormatTime(Time time) {
  char text[40];
  std::snprintf(text, sizeof text, "(%010lld.%06lld)",
                static_cast<long long>(ToUtime(time) / kMicrosecondsPerSecond),
                static_cast<long long>(ToUtime(time) % kMicrosecondsPerSecond));
  return text;
}

std::string FormatId(const CanFrame& frame) {
  if (frame.error) return Hex(frame.id | kErrorFlag, 8);
  return Hex(frame.id, frame.extended ? 8 : 3);
}

}  // namespace

std::optional<CandumpLine> ParseCandumpLine(std::string_view line) {
  while (line.ends_with('\n') || line.ends_with('\r')) line.remove_suffix(1);
  // Newer versions of candump add whether the frame was received or sent.
  if (line.ends_with(" R") || line.ends_with(" T")) line.remove_suffix(2);
  CandumpLine result;
  if (!line.starts_with('(')) return std::nullopt;
  line.remove_prefix(1);
  const auto time_text = Take(line, ')');
  const auto time = time_text ? ReadTime(*time_text) : std::nullopt;
  if (!time || !line.starts_with(' ')) return std::nullopt;
  line.remove_prefix(1);
  const auto interface = Take(line, ' ');
  const auto id = Take(line, '#');
  if (!interface || interface->empty() || !id || !ReadId(*id, result.frame)) return std::nullopt;
  if (!ReadContent(line, result.frame)) return std::nullopt;
  result.interface = *interface;
  result.frame.time = *time;
  return result;
}

std::string FormatCandumpLine(const CandumpLine& line) {
  const CanFrame& frame = line.frame;
  std::string text = FormatTime(frame.time) + " " + line.interface + " " + FormatId(frame) + "#";
  if (frame.remote) return text + "R" + (frame.size > 0 ? std::to_string(frame.size) : "");
  if (frame.fd) text += "#" + Hex(frame.fd_flags, 1);
  for (int i = 0; i < frame.size; ++i) text += Hex(frame.data[i], 2);
  return text;
}

}  // namespace vog
