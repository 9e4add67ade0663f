#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace vog {

/// Evaluates the finished simulated run in `folder` and writes its report; returns the metrics.
/// Memory that the run and each step have used goes back to the system first, so that their needs
/// do not add up. @throws as EvaluateRun() and WriteReport().
nlohmann::ordered_json JudgeRun(const std::filesystem::path& folder);

}  // namespace vog
