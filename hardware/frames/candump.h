#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hardware/frames/can_frame.h"

namespace vog {

/// A line of a log of can-utils' `candump -l`: `(1436509052.249713) vcan0 044#2A366C2BBA`.
struct CandumpLine {
  std::string interface;
  CanFrame frame;

  bool operator==(const CandumpLine&) const = default;
};

/// Reads the five forms: 3 digits of identifier (standard), 8 (extended), 8 with bit 29 set
/// (error), `#R` with or without a length (remote), `##` and a digit of flags (FD). Nothing where
/// the line is none of them.
std::optional<CandumpLine> ParseCandumpLine(std::string_view line);

/// The line that ParseCandumpLine() reads back, without its end of line.
std::string FormatCandumpLine(const CandumpLine& line);

}  // namespace vog
