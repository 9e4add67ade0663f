#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/log/log_selection.h"

namespace vog {

/// @throws UsageError when `out` is the file `in`, by whatever name.
void RefuseSame(const std::string& in, const std::string& out);

// Both return how many messages the new log holds, and throw UsageError when it is one of those
// that are read.

/// Copies a part of a log.
std::int64_t CutLog(const std::string& in, const LogSelection& selection, const std::string& out);

/// Makes one log of several, in the order of time; at one time those of the first log come first.
std::int64_t MergeLogs(const std::vector<std::string>& in, const std::string& out);

}  // namespace vog
