#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "lib/base/errors.h"
#include "tools/launch/launch.h"
#include "tools/launch/pmd_file.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

struct Arguments {
  LaunchOptions launch;
  bool validate = false;
};

void Run(const Arguments& arguments) {
  if (!arguments.validate) {
    Launch(arguments.launch);
    return;
  }
  if (arguments.launch.file.empty()) throw UsageError("--validate needs a file; see --help");
  std::printf("%s", ToPmd(ReadPmd(arguments.launch.file)).c_str());
}

}  // namespace

void AddLaunchCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "launch",
      "Start a table of processes, keep them running, and stop them in order.\n"
      "FILE is in bot2-procman's grammar: cmd, group and script. vog launch is its deputy and a "
      "simple sheriff in one, on the channels PMD_ORDERS2, PMD_INFO2, PMD_PRINTF and PMD_DISCOVER; "
      "without FILE a deputy alone, for a sheriff elsewhere.\n"
      "The script \"start\" runs first; without one everything starts. A vog- program counts as "
      "running once it tells STATUS. $VOG_CONFIG in exec is the folder above FILE's, $VOG_OUT that "
      "of --output.");
  const auto arguments = std::make_shared<Arguments>();
  LaunchOptions& launch = arguments->launch;
  launch.output_folder = "out/launch";
  command->add_option("file", launch.file, "table of processes (.pmd)");
  command->add_flag("--validate", arguments->validate,
                    "only check the file, and print what it means");
  command->add_option("--script", launch.script, "run this one first");
  command->add_option("--deputy", launch.deputy,
                      "name of the deputy; without, that of the machine");
  command->add_option("--output", launch.output_folder, "folder for what each command says")
      ->capture_default_str();
  command->add_option("--url", launch.url, "LCM provider")->capture_default_str();
  command
      ->add_option("--ready-timeout", launch.ready_timeout_s,
                   "seconds until a command that is not ready is a failure")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
