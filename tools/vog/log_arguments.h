#pragma once

#include <CLI/CLI.hpp>
#include <limits>
#include <string>

#include "tools/log/log_selection.h"

namespace vog {

inline CLI::Option* AddChannelsOption(CLI::App& command, std::string& channels) {
  return command.add_option("--channels", channels,
                            "regular expression for whole channel names; the word inputs stands "
                            "for what the vehicle says");
}

inline CLI::Option* AddFromOption(CLI::App& command, LogSelection& selection) {
  return command.add_option("--from", selection.from_s, "seconds after the log's first message")
      ->check(CLI::NonNegativeNumber);
}

inline CLI::Option* AddToOption(CLI::App& command, LogSelection& selection) {
  return command.add_option("--to", selection.to_s, "the same, the last one")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace vog
