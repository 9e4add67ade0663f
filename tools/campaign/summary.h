#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/campaign/campaign_folder.h"

namespace vog {

/// A mission's metrics, or why there are none.
struct MissionResult {
  std::int64_t seed = 0;
  nlohmann::ordered_json metrics;  ///< Null when it failed.
  std::string error;
};

/// The missions of one case.
struct CaseResults {
  std::string name;
  std::vector<MissionResult> missions;  ///< In order of their seeds.
};

/// Reads the results that are in `folder`.
std::vector<CaseResults> ReadResults(const CampaignFolder& folder, const Campaign& campaign);

/// The statistics of a case; what they are: docs/formats.md, campaign.json.
nlohmann::ordered_json SummaryOf(const CaseResults& results);

/// All cases: what campaign.json holds. A function of the results alone.
nlohmann::ordered_json SummaryOf(const Campaign& campaign, const std::vector<CaseResults>& results);

/// The same as a table to read, a column a case.
std::string TableOf(const nlohmann::ordered_json& summary);

/// Writes what `folder` holds into its campaign.json and campaign.txt; returns the former.
nlohmann::ordered_json WriteTables(const CampaignFolder& folder, const Campaign& campaign);

}  // namespace vog
