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

/// The rows of that table, the first one with the cases' names.
std::vector<std::vector<std::string>> RowsOf(const nlohmann::ordered_json& summary);

/// A row a case: the errors of the maps [Ho et al. 2018, Table II], with 95 % intervals.
std::vector<std::vector<std::string>> MapErrorRowsOf(const nlohmann::ordered_json& summary);

/// A row a case: what loop closures are worth, as ratios of these errors and seed by seed.
std::vector<std::vector<std::string>> ClosureGainRowsOf(const nlohmann::ordered_json& summary);

/// Writes what `folder` holds into its campaign.json, campaign.txt and campaign.html, the latter
/// where there is gnuplot; returns the first.
nlohmann::ordered_json WriteTables(const CampaignFolder& folder, const Campaign& campaign);

}  // namespace vog
