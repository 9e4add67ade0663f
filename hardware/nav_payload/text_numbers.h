#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vog {

/// The decimal number that the whole of `text` is, with or without a sign. Nothing where it is none
/// or beyond ten thousand million: no instrument says such.
std::optional<double> ParseNumber(std::string_view text);
/// The same for whole numbers.
std::optional<int> ParseInteger(std::string_view text);

/// With exactly so many digits after the point.
std::string ToFixed(double value, int decimals);
/// The same with zeros in front up to `width` characters.
std::string ToPadded(double value, int decimals, std::size_t width);
/// The same with its sign always in front.
std::string ToSigned(double value, int decimals);

/// What stands between the separators, blanks around it taken away.
std::vector<std::string> SplitFields(std::string_view text, char separator);

}  // namespace vog
