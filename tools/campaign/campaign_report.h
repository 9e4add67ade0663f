#pragma once

#include "tools/campaign/summary.h"

namespace vog {

/// A campaign on one page, with all pictures in it: tables, intervals and paired tests, the maps'
/// errors of each mission, coverage against time, planning time against submaps, the settings in
/// which the cases differ, links to the missions' reports where they are kept. But for planning
/// times, which are the machine's, it is a function of the campaign and its results, wherever they
/// were flown. @throws SystemError when gnuplot fails.
std::string CampaignReport(const CampaignFolder& folder, const Campaign& campaign,
                           const std::vector<CaseResults>& results,
                           const nlohmann::ordered_json& summary);

/// Writes it into the folder's campaign.html. Without gnuplot there is none, which is told.
void WriteCampaignReport(const CampaignFolder& folder, const Campaign& campaign,
                         const std::vector<CaseResults>& results,
                         const nlohmann::ordered_json& summary);

}  // namespace vog
