#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "lib/base/files.h"
#include "lib/base/parallel.h"
#include "tools/campaign/local_engine.h"
#include "tools/campaign/summary.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::string config, seeds, out, mission;
  std::string engine = "local";
  int jobs = ProcessorCount();
  bool json = false;
};

std::size_t CountFailed(const Json& summary) {
  std::size_t failed = 0;
  for (const Json& one : summary["cases"]) failed += one["failed"].size();
  return failed;
}

void FlyMissing(const CampaignFolder& folder, const Campaign& campaign, int jobs) {
  std::vector<MissionId> missing = campaign.Missions();
  std::erase_if(missing, [&](const MissionId& mission) { return folder.IsFinished(mission); });
  FlyLocally(folder, missing, jobs);
}

void RunCampaign(const Arguments& arguments) {
  std::optional<SeedRange> seeds;
  if (!arguments.seeds.empty()) seeds = ParseSeeds(arguments.seeds, "--seeds: ");
  const Campaign campaign = LoadCampaign(arguments.config, seeds);
  const CampaignFolder folder(arguments.out, campaign);
  FlyMissing(folder, campaign, arguments.jobs);
  const Json summary = SummaryOf(campaign, ReadResults(folder, campaign));
  const std::string json = summary.dump(2) + "\n", table = TableOf(summary);
  WriteFileAtomically(folder.path() / "campaign.json", json);
  WriteFileAtomically(folder.path() / "campaign.txt", table);
  std::fputs((arguments.json ? json : table).c_str(), stdout);
  std::fflush(stdout);
  if (const std::size_t failed = CountFailed(summary); failed > 0)
    throw SystemError(
        std::to_string(failed) + " of " + std::to_string(campaign.Missions().size()) +
        " missions failed; the table says why, and the same command tries them again");
}

void Run(const Arguments& arguments) {
  if (!arguments.mission.empty()) {
    FlyTask(arguments.out, arguments.mission);
  } else if (arguments.config.empty()) {
    throw UsageError("name a campaign file; see vog campaign --help");
  } else {
    RunCampaign(arguments);
  }
}

}  // namespace

void AddCampaignCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "campaign",
      "Fly missions over cases and seeds, and tell means, intervals and paired tests.\n"
      "A campaign file names its cases:\n\n"
      "  [campaign]\n"
      "  name = \"tanks\"\n"
      "  seeds = \"1..10\"\n"
      "  keep = [\"map\"]                  # also: log report clouds trajectories\n\n"
      "  [[case]]\n"
      "  name = \"tank literal\"\n"
      "  mission = \"../mission/tank.toml\"\n\n"
      "  [[case]]\n"
      "  name = \"tank random walk\"\n"
      "  mission = \"../mission/tank.toml\"\n"
      "  set = [\"drift.scaling=random_walk\"]\n\n"
      "Each mission lands in DIR/CASE/SEED, the statistics in DIR/campaign.txt and campaign.json.\n"
      "The same command goes on where another one was stopped or killed, and flies what failed or "
      "is missing, for example further seeds. Exit status 1 when missions failed twice.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("config", arguments->config, "campaign file (TOML)");
  command->add_option("--out", arguments->out, "the campaign's folder")->required();
  command->add_option("--seeds", arguments->seeds, "A..B instead of the file's");
  command->add_option("--engine", arguments->engine, "local: processes of this machine")
      ->check(CLI::IsMember({"local"}))
      ->capture_default_str();
  command->add_option("--jobs", arguments->jobs, "missions that fly at a time")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print JSON");
  command->add_option("--fly", arguments->mission,
                      "CASE/SEED: fly this one mission of the campaign in DIR and nothing else, as "
                      "the processes do that the campaign starts");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
