#pragma once

#include <vector>

#include "tools/campaign/campaign_folder.h"

namespace vog {

/// How often a mission of a campaign on this machine is flown until it has failed.
inline constexpr int kLocalAttempts = 2;

/// Flies missions with `jobs` processes of this program at a time, each up to `attempts` times, and
/// shows how far it is. What failed each time has no result, and its output's last line says why.
/// @throws SystemError after SIGINT or SIGTERM, with nothing flying any more.
void FlyLocally(const CampaignFolder& folder, const std::vector<MissionId>& missions, int jobs,
                int attempts);

}  // namespace vog
