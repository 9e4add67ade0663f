#include <CLI/CLI.hpp>
#include <memory>

#include "tools/log/play.h"
#include "tools/mission/replay.h"
#include "tools/vog/commands.h"
#include "tools/vog/log_arguments.h"

namespace vog {
namespace {

struct Arguments {
  std::string out;
  std::optional<std::string> resume;
  bool live = false;
  PlayOptions play;
};

void Run(const Arguments& arguments, bool has_live_options) {
  if (arguments.live == !arguments.out.empty())
    throw UsageError("replay takes either --out DIR or --live; see --help");
  if (!arguments.live && has_live_options)
    throw UsageError(
        "--speed, --from, --to, --channels, --loop and --url go with --live; a log cut "
        "by vog log cut can be replayed to --out");
  if (arguments.live && arguments.resume) throw UsageError("--resume goes with --out");
  if (arguments.live) {
    PlayLog(arguments.play);
  } else {
    ReplayLog(arguments.play.log, arguments.out, arguments.resume);
  }
}

}  // namespace

void AddReplayCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "replay",
      "With --out: run all nodes on a log's inputs, in lock step; the same log gives the same "
      "map.\n"
      "With --live: publish the log on LCM at its own pace. Keys on a terminal: space pause, s "
      "step "
      "one message, + and - speed, left and right arrow 10 s back and forward, q quit.");
  const auto arguments = std::make_shared<Arguments>();
  PlayOptions& play = arguments->play;
  command->add_option("log", play.log, "LCM event log of a run")->required();
  command->add_option("--out", arguments->out, "folder for the map and all else");
  command->add_option("--resume", arguments->resume,
                      "the run, or its map, that this one went on from; else the one that is kept "
                      "beside the log");
  command->add_flag("--live", arguments->live, "publish the log on LCM");
  const std::vector<CLI::Option*> live_options = {
      command->add_option("--speed", play.speed, "times its own pace")
          ->check(CLI::Range(0.001, 1000.0)),
      AddFromOption(*command, play.selection),
      AddToOption(*command, play.selection),
      AddChannelsOption(*command, play.selection.channels),
      command->add_flag("--loop", play.is_endless, "from the start again after its end"),
      command->add_option("--url", play.url, "LCM provider")->capture_default_str()};
  command->callback([arguments, live_options] {
    Run(*arguments, std::any_of(live_options.begin(), live_options.end(),
                                [](const CLI::Option* option) { return option->count() > 0; }));
  });
}

}  // namespace vog
