#pragma once

#include <map>
#include <string>

namespace vog {

/// Every value that a mission's settings (TOML) set, as it is written, by its name:
/// "planner.range_m", "keep_out[0].min_m". Nothing of what is no TOML.
std::map<std::string, std::string> SettingsOf(const std::string& toml);

}  // namespace vog
