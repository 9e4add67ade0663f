#pragma once

#include <filesystem>
#include <string>

#include "lib/bus/lcm_bus.h"

namespace vog {

struct LaunchOptions {
  std::filesystem::path file;           ///< .pmd; none: a deputy alone, for a sheriff elsewhere.
  std::string deputy;                   ///< Its name; empty: the machine's.
  std::string script;                   ///< To begin with; empty: "start", or everything.
  std::filesystem::path output_folder;  ///< What each command says.
  std::string url = BusOptions().url;
  double ready_timeout_s = 30;
};

/// Runs a deputy and, with a file, a sheriff until SIGINT or SIGTERM; then stops all commands in
/// order. Unless they are set, $VOG_CONFIG is the folder above the file's and $VOG_OUT that for
/// output.
/// @throws UsageError for a bad file, SystemError when a command does not get ready in time, or
/// when another deputy of that name runs: then nothing is left running.
void Launch(const LaunchOptions& options);

}  // namespace vog
