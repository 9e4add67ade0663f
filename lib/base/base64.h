#pragma once

#include <string>
#include <string_view>

namespace vog {

/// RFC 4648, with padding.
std::string ToBase64(std::string_view bytes);

}  // namespace vog
