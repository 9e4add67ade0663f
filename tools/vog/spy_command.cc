#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/spy/spy.h"
#include "tools/vog/commands.h"

namespace vog {

void AddSpyCommand(CLI::App& app) {
  struct Arguments {
    std::string url = BusOptions().url;
    bool jar_only = false;
  };
  auto* command = app.add_subcommand(
      "spy",
      "Start LCM's lcm-spy with our message types. They are compiled at the first use, into "
      "$XDG_CACHE_HOME/vogmap; that needs a JDK.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("--url", arguments->url, "LCM provider")->capture_default_str();
  command->add_flag("--jar", arguments->jar_only,
                    "only compile the types, and print where they are");
  command->callback([arguments] {
    if (!arguments->jar_only) BecomeSpy(arguments->url);
    std::printf("%s\n", TypesJar().c_str());
  });
}

}  // namespace vog
