#pragma once

#include <filesystem>
#include <optional>

#include "lib/base/config.h"

namespace vog {

/// The folder in a run's folder that keeps the run it went on from: map/, lcm.log where there is
/// one, and that run's own earlier/.
inline constexpr const char* kEarlier = "earlier";

/// A run that a mission goes on from.
struct EarlierRun {
  std::filesystem::path map;                     ///< Its map folder.
  std::optional<std::filesystem::path> log;      ///< Its lcm.log.
  std::optional<std::filesystem::path> earlier;  ///< The run that it went on from itself.
};

/// `path` is a run's folder or its map folder. A log beside the map that is another run's does not
/// count. @throws UsageError when there is no map.
EarlierRun FindEarlierRun(const std::filesystem::path& path);

/// Sets what a simulated mission needs to go on from a run: map.resume, and that the simulator
/// begins after it, with the vehicle put in with an error that [put_in] allows, which its own
/// reckoning does not know of. Where the run's log tells the truth, the vehicle is put in from
/// where it truly was. @throws UsageError when the map cannot be gone on from.
void GoOnFrom(const EarlierRun& run, Config& config);

/// Copies a run into `folder`/earlier, as links where the file system can. @throws SystemError.
void KeepEarlierRun(const EarlierRun& run, const std::filesystem::path& folder);

/// @throws UsageError when a mission into `folder` would remove the run that it is to go on from.
void RejectFolderOf(const EarlierRun& run, const std::filesystem::path& folder);

}  // namespace vog
