#pragma once

#include <filesystem>

#include "procs/viewer/viewer_options.h"

namespace vog {

/// Serves the page of vog-viewer for what lies on the disk, and prints its address: an LCM log, the
/// folder of a run, or a map folder. A log is read while pages already look. Ends with SIGINT or
/// SIGTERM.
/// @throws UsageError where there is nothing of that, or for options that do not go together,
/// SystemError when the page cannot be served.
void ServeRun(const std::filesystem::path& path, const ViewerOptions& options);

}  // namespace vog
