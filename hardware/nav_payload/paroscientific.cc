#include "hardware/nav_payload/paroscientific.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hardware/nav_payload/text_numbers.h"

namespace vog {
namespace {

constexpr std::size_t kHeadSize = 5;  // *DDSS
constexpr int kMaxUnit = 99;

struct Code {
  ParosCommand::Kind kind;
  std::string_view text;
  bool has_value;
};
constexpr std::array kCodes = {
    Code{ParosCommand::kSample, "P3", false}, Code{ParosCommand::kContinuous, "P4", false},
    Code{ParosCommand::kUnit, "UN=", true}, Code{ParosCommand::kPeriod, "PR=", true}};

bool IsNumeral(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789.") == std::string_view::npos;
}

std::string Head(int to, int from) { return "*" + ToPadded(to, 0, 2) + ToPadded(from, 0, 2); }

std::string_view TrimEnd(std::string_view line) {
  while (!line.empty() && line.back() <= ' ') line.remove_suffix(1);
  return line;
}

std::optional<ParosCommand> ReadCommand(std::string_view text, int unit) {
  for (const Code& code : kCodes) {
    if (!text.starts_with(code.text)) continue;
    const std::string_view rest = text.substr(code.text.size());
    if (!code.has_value)
      return rest.empty() ? std::optional(ParosCommand{code.kind, unit}) : std::nullopt;
    if (!IsNumeral(rest)) return std::nullopt;
    const auto value = ParseInteger(rest);
    return value ? std::optional(ParosCommand{code.kind, unit, *value}) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> ParseParosReply(std::string_view line) {
  line = TrimEnd(line);
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos || line.size() - star <= kHeadSize) return std::nullopt;
  const std::string_view head = line.substr(star + 1, kHeadSize - 1);
  const std::string_view value = line.substr(star + kHeadSize);
  if (!head.starts_with("00") || head.ends_with("00") || !IsNumeral(head) || !IsNumeral(value) ||
      head.find('.') != std::string_view::npos)
    return std::nullopt;
  return ParseNumber(value);
}

std::string FormatParosReply(double pressure, int unit) {
  return Head(0, unit) + ToFixed(pressure, 7) + "\r\n";
}

std::optional<ParosCommand> ParseParosCommand(std::string_view line) {
  line = TrimEnd(line);
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos || line.size() - star < kHeadSize) return std::nullopt;
  const std::string_view head = line.substr(star, kHeadSize);
  if (!IsNumeral(head.substr(1, 2)) || !head.ends_with("00")) return std::nullopt;
  const auto unit = ParseInteger(head.substr(1, 2));
  if (!unit || *unit < 1 || *unit > kMaxUnit) return std::nullopt;
  const auto command = ReadCommand(line.substr(star + kHeadSize), *unit);
  const std::string allows = std::string(head) + "EW";
  const bool is_setting = command && command->kind >= ParosCommand::kUnit;
  return !is_setting || line.substr(0, star).ends_with(allows) ? command : std::nullopt;
}

std::string FormatParosCommand(const ParosCommand& command) {
  const Code& code = *std::find_if(kCodes.begin(), kCodes.end(),
                                   [&](const Code& c) { return c.kind == command.kind; });
  const std::string head = Head(command.unit, 0);
  const std::string text = head + std::string(code.text);
  if (!code.has_value) return text + "\r\n";
  return head + "EW" + text + std::to_string(command.value) + "\r\n";
}

int ParosPeriod(double rate_hz) {
  return std::max(1, static_cast<int>(std::lround(1 / (rate_hz * 0.007913))));
}

}  // namespace vog
