#pragma once

#include <string>
#include <string_view>

namespace vog {

/// The text with a question mark for each byte that is no part of a character in UTF-8 (RFC 3629):
/// LCM's strings may hold anything, Protobuf's may not.
std::string ToUtf8(std::string_view text);

}  // namespace vog
