#pragma once

#include <filesystem>
#include <vector>

namespace vog {

/// Turns the finished run in `folder` into `folder`/report.html: one file with all pictures in it
/// that needs nothing else and no scripts. It depends on the folder's content alone, byte for byte.
/// What the run has not got (a vehicle's run has no truth, a live one no planning times) is said.
/// @throws UsageError for a folder that is not a finished run, SystemError when gnuplot is missing
/// or fails.
void WriteReport(const std::filesystem::path& folder);

/// The same into a file of another name.
void WriteReport(const std::filesystem::path& folder, const std::filesystem::path& out);

/// Compares finished runs on one page: mean and spread of all key figures, grouped by scene and
/// mode, and the runs' curves over each other. @throws as above.
void WriteComparison(const std::vector<std::filesystem::path>& folders,
                     const std::filesystem::path& out);

}  // namespace vog
