#pragma once

#include <string>
#include <vector>

#include "lib/base/config.h"
#include "lib/base/config_tables.h"

namespace vog {

/// A configuration as it is named on the command line.
struct ConfigArguments {
  std::string file;                   ///< Empty: all settings are defaults.
  std::vector<std::string> settings;  ///< table.key=value, on top of the file.

  /// @throws UsageError naming file and line, or the setting.
  Config Load() const {
    Config config = file.empty() ? Config() : Config::Load(file);
    for (const std::string& setting : settings) config.Set(setting);
    config.RejectUnknownTables(kConfigTables);
    return config;
  }
};

}  // namespace vog
