#include <CLI/CLI.hpp>
#include <memory>

#include "tools/mission/replay.h"
#include "tools/vog/commands.h"

namespace vog {

void AddReplayCommand(CLI::App& app) {
  struct Arguments {
    std::string log, out;
  };
  auto* command = app.add_subcommand(
      "replay", "Run all nodes on a log's inputs, in lock step; the same log gives the same map.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->log, "LCM event log of a run")->required();
  command->add_option("--out", arguments->out, "folder for the map and all else")->required();
  command->callback([arguments] { ReplayLog(arguments->log, arguments->out); });
}

}  // namespace vog
