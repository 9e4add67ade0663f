#pragma once

#include <filesystem>
#include <string>

#include "tools/launch/child_process.h"

namespace vog {

/// The program and words that a procman `exec` means: NAME=value before the program, quotes and
/// $VARIABLES as a shell reads them, no commands in commands. A program without a '/' is looked for
/// in `program_folder` first, then in PATH.
/// @throws UsageError for what cannot be read so, or a program that is nowhere.
ChildCommand ParseExec(const std::string& exec, const std::filesystem::path& program_folder);

}  // namespace vog
