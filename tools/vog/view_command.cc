#include <CLI/CLI.hpp>
#include <memory>

#include "tools/view/view_log.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

struct Arguments {
  std::string path;
  ViewerOptions options;
};

}  // namespace

void AddViewCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "view",
      "Look at a run in a browser, with a time slider: prints the page's address and serves it "
      "until Ctrl-C. A running system has the same page by itself, from vog-viewer.");
  const auto arguments = std::make_shared<Arguments>();
  ViewerOptions& options = arguments->options;
  command->add_option("run", arguments->path, "an LCM log, the folder of a run, or a map folder")
      ->required();
  command->add_option("--bind", options.bind, "address to serve on")->capture_default_str();
  command->add_option("--port", options.port, "0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->add_option("--token", options.token,
                      "what the page asks for; needed on another address than loopback");
  command->callback([arguments] { ServeRun(arguments->path, arguments->options); });
}

}  // namespace vog
