#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/mission/live.h"
#include "tools/mission/mission.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

struct Arguments {
  std::string config, out;
  std::optional<std::string> resume;
  MissionOverrides overrides;
  bool is_live = false;
  double speed = 10;
};

void Run(const Arguments& arguments) {
  Config config = ReadMission(arguments.config, arguments.overrides);
  const auto earlier = Resume(arguments.resume, config);
  NumberRun(config);
  const auto metrics = arguments.is_live
                           ? RunLiveMission(config, arguments.out, arguments.speed, earlier)
                           : RunMission(config, arguments.out, earlier);
  std::printf("%s\n", metrics.dump(2).c_str());
}

}  // namespace

void AddMissionCommand(CLI::App& app) {
  auto* command = app.add_subcommand("mission", "Explore a simulated structure and judge the map.");
  const auto arguments = std::make_shared<Arguments>();
  MissionOverrides& overrides = arguments->overrides;
  command->add_option("config", arguments->config, "mission file (TOML)")->required();
  command->add_option("--out", arguments->out, "folder for map, log, metrics and report")
      ->required();
  command->add_option("--resume", arguments->resume,
                      "a run, or its map, to go on from: the vehicle is put in again as [put_in] "
                      "tells, where that run ended unless it says otherwise; the map of both is "
                      "kept in --out");
  command->add_option("--mode", overrides.mode, "vog, vog-no-lc or standard");
  command->add_option("--seed", overrides.seed, "seed of all that is random");
  command->add_option("--max-submaps", overrides.max_submaps, "budget");
  command->add_option(
      "--scene", overrides.scene,
      "a mesh (STL, OBJ, PLY, DAE; z up, metres) to explore instead; the exploration "
      "box is its bounds plus 3 m and the start the first free corner of it, unless "
      "--set says otherwise");
  command->add_flag("--live", arguments->is_live,
                    "real processes over LCM instead of lock step in one process");
  command->add_option("--speed", arguments->speed, "with --live: vehicle time over real time")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  command->add_option("--set", overrides.settings, "table.key=value, on top of the file");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
