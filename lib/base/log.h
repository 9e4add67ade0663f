#pragma once

#include <functional>
#include <string_view>

namespace vog {

/// Writes "NAME: text" as one line to standard error, where NAME is the running program.
void LogLine(std::string_view text);

/// Runs a program's body and turns what it throws into one line and an exit status: 2 for a
/// UsageError, 1 for anything else.
int RunMain(const std::function<int()>& body);

}  // namespace vog
