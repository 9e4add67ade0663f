#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/launch/child_process.h"

namespace vog {

/// The words of a line as a shell reads them: quotes and $VARIABLES, no commands in commands.
/// @throws UsageError that begins with `where` and the line.
std::vector<std::string> ShellWords(const std::string& line, const std::string& where);

/// The program of that name in PATH.
std::optional<std::filesystem::path> FindInPath(const std::string& program);

/// The program and words that a procman `exec` means: NAME=value before the program, quotes and
/// $VARIABLES as a shell reads them, no commands in commands. A program without a '/' is looked for
/// in `program_folder` first, then in PATH.
/// @throws UsageError for what cannot be read so, or a program that is nowhere.
ChildCommand ParseExec(const std::string& exec, const std::filesystem::path& program_folder);

}  // namespace vog
