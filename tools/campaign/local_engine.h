#pragma once

#include <vector>

#include "tools/campaign/campaign_folder.h"

namespace vog {

/// Flies missions with `jobs` processes of this program at a time, those that fail once more, and
/// shows how far it is. What failed twice has no result, and its output's last line says why.
/// @throws SystemError after SIGINT or SIGTERM, with nothing flying any more.
void FlyLocally(const CampaignFolder& folder, const std::vector<MissionId>& missions, int jobs);

}  // namespace vog
