#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/planner/mission_options.h"
#include "tools/mission/lock_step.h"
#include "tools/mission/progress_bar.h"
#include "tools/mission/resume.h"

namespace vog {

/// The command line's changes to a mission file.
struct MissionOverrides {
  std::optional<std::string> mode;
  std::optional<std::int64_t> seed;
  std::optional<int> max_submaps;
  std::optional<std::string> scene;   ///< A mesh file.
  std::vector<std::string> settings;  ///< table.key=value.
};

/// Reads a mission file, puts the overrides on top, and checks every table of it. @throws
/// UsageError.
Config ReadMission(const std::string& file, const MissionOverrides& overrides);

/// Gives a run without a number, bus.run_id, one that depends on its settings alone, so that equal
/// missions give equal logs.
void NumberRun(Config& config);

/// Checks every table that any process or tool reads. @throws UsageError.
void CheckConfig(const Config& config);

/// Makes a mission go on from the run, or the map, in `resume` or else in map.resume, if any.
/// @pre the run has no number yet: it depends on the settings that this makes. @throws UsageError.
std::optional<EarlierRun> Resume(const std::optional<std::string>& resume, Config& config);

/// Flies a mission in lock step and leaves in `folder`: lcm.log, map/, scene.ply and timing.json.
/// What an earlier mission left there is removed first. @throws UsageError, SystemError.
void FlyMission(const Config& config, const std::filesystem::path& folder,
                const std::optional<EarlierRun>& earlier = {});

/// The same, and all that EvaluateRun() and WriteReport() write. Returns the metrics.
nlohmann::ordered_json RunMission(const Config& config, const std::filesystem::path& folder,
                                  const std::optional<EarlierRun>& earlier = {});

/// Empties `folder` and keeps `earlier`, if any, in it. Returns where its map is then, as
/// map.resume. @throws UsageError, SystemError.
std::string PrepareFolder(const std::filesystem::path& folder,
                          const std::optional<EarlierRun>& earlier);

/// Creates `folder`, or empties it of what an earlier mission left.
void PrepareFolder(const std::filesystem::path& folder);

/// Writes the wall times of a run.
void WriteTiming(const RunTiming& timing, const std::filesystem::path& file);

/// The share of its submaps or of its time that a run has used, whichever is more.
double BudgetUsed(const RunProgress& progress, const MissionOptions& mission);

/// Draws how much of its budget a run has used, with a line about how far it is.
void ShowProgress(const RunProgress& progress, const MissionOptions& mission, double wall_s,
                  ProgressBar& bar);

}  // namespace vog
