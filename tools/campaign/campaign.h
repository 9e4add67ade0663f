#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/config.h"

namespace vog {

/// Seeds from the first to the last, both too.
struct SeedRange {
  std::int64_t first = 1, last = 1;
};

/// Reads "A..B", or "A" for one seed. @throws UsageError that begins with `where`.
SeedRange ParseSeeds(const std::string& text, const std::string& where);

/// Missions that differ in their seeds alone.
struct CampaignCase {
  std::string name;    ///< "tank literal"
  std::string folder;  ///< "tank-literal"
  Config mission;      ///< All settings but the seed.
};

/// A mission of a campaign.
struct MissionId {
  std::string case_folder;
  std::int64_t seed = 0;

  std::string text() const { return case_folder + "/" + std::to_string(seed); }
};

/// Reads "CASE/SEED". @throws UsageError.
MissionId ParseMission(const std::string& text);

/// Missions over cases and seeds.
struct Campaign {
  std::string name;
  SeedRange seeds;
  std::vector<std::string> keep;  ///< What of each mission is kept; see KeepNames().
  std::vector<CampaignCase> cases;

  /// Case by case, in the order of the file; of each all seeds.
  std::vector<MissionId> Missions() const;
};

/// What a campaign file may ask to keep of each mission beside its numbers.
const std::vector<std::string>& KeepNames();

/// Reads a campaign file (docs/formats.md) and its missions, and looks whether they can be flown.
/// `seeds` replace the file's. @throws UsageError naming file and line.
Campaign LoadCampaign(const std::string& file, const std::optional<SeedRange>& seeds);

/// Looks whether each of `words` is in the name of a case. @throws UsageError naming one that is
/// not.
void CheckCases(const Campaign& campaign, const std::vector<std::string>& words);

/// The campaign with those cases whose names contain one of `words`, in the order of the file; with
/// all of them without words. @throws UsageError as CheckCases().
Campaign WithCases(Campaign campaign, const std::vector<std::string>& words);

}  // namespace vog
