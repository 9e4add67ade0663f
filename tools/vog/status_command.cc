#include <CLI/CLI.hpp>
#include <memory>

#include "tools/status/status.h"
#include "tools/vog/commands.h"

namespace vog {

void AddStatusCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "status",
      "How the running system is: processes (STATUS), deputies (PMD_INFO2), the mission, the map, "
      "and the rate of each channel. Silent is who was not heard for 3 s.");
  const auto options = std::make_shared<StatusOptions>();
  command->add_flag("--once", options->once,
                    "listen for 2 s, print, and end; exit status 1 when nothing is heard");
  command->add_flag("--json", options->json, "a line of JSON each time");
  command->add_option("--url", options->url, "LCM provider")->capture_default_str();
  command->callback([options] { ShowStatus(*options); });
}

}  // namespace vog
