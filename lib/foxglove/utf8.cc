#include "lib/foxglove/utf8.h"

#include <algorithm>
#include <cstdint>

namespace vog {
namespace {

bool GoesOn(char byte) { return (static_cast<std::uint8_t>(byte) & 0xC0) == 0x80; }

/// Whether these two bytes may start a character of several: none that a shorter one could say, no
/// surrogate, nothing above U+10FFFF.
bool MayStart(std::uint8_t first, std::uint8_t second) {
  switch (first) {
    case 0xE0:
      return second >= 0xA0;
    case 0xED:
      return second < 0xA0;
    case 0xF0:
      return second >= 0x90;
    case 0xF4:
      return second < 0x90;
    default:
      return first >= 0xC2 && first < 0xF4;
  }
}

/// Bytes of the character that a text starts with; 0 where it starts with none. @pre it is not
/// empty.
std::size_t FirstCharacter_bytes(std::string_view text) {
  const auto first = static_cast<std::uint8_t>(text[0]);
  if (first < 0x80) return 1;
  const std::size_t size = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (text.size() < size || !MayStart(first, static_cast<std::uint8_t>(text[1]))) return 0;
  const std::string_view rest = text.substr(1, size - 1);
  return std::all_of(rest.begin(), rest.end(), GoesOn) ? size : 0;
}

}  // namespace

std::string ToUtf8(std::string_view text) {
  std::string valid;
  while (!text.empty()) {
    const std::size_t size = FirstCharacter_bytes(text);
    valid += size > 0 ? text.substr(0, size) : "?";
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return valid;
}

}  // namespace vog
