#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

#include "lib/base/errors.h"
#include "lib/base/parallel.h"
#include "tools/campaign/local_engine.h"
#include "tools/campaign/slurm.h"
#include "tools/campaign/slurm_engine.h"
#include "tools/campaign/summary.h"
#include "tools/launch/command_line.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<std::string> cases;
  std::string config, seeds, out, mission, sbatch;
  std::string engine = "local";
  int jobs = 0, per_task = 0, slurm_task = 0, slurm_close = 0;
  bool json = false;

  bool is_slurm() const { return engine == "slurm"; }
};

std::size_t CountFailed(const Json& summary) {
  std::size_t failed = 0;
  for (const Json& one : summary["cases"]) failed += one["failed"].size();
  return failed;
}

/// Looks whether the arguments belong to the engine, before anything is written.
void CheckEngine(const Arguments& arguments) {
  if (arguments.is_slurm()) {
    Slurm("", {});  // Throws where there is none.
  } else if (arguments.per_task > 0 || !arguments.sbatch.empty()) {
    throw UsageError(std::string(arguments.per_task > 0 ? "--per-task" : "--sbatch") +
                     " is for --engine slurm");
  }
}

void FlyMissing(const CampaignFolder& folder, const Campaign& campaign,
                const Arguments& arguments) {
  if (arguments.is_slurm()) {
    FlyBySlurm(folder, campaign,
               {campaign.seeds, arguments.cases, arguments.jobs, arguments.per_task,
                ShellWords(arguments.sbatch, "--sbatch")});
  } else {
    FlyLocally(folder, MissingOf(folder, campaign.Missions()),
               arguments.jobs > 0 ? arguments.jobs : ProcessorCount(), kLocalAttempts);
  }
}

void RunCampaign(const Arguments& arguments) {
  std::optional<SeedRange> seeds;
  if (!arguments.seeds.empty()) seeds = ParseSeeds(arguments.seeds, "--seeds: ");
  CheckEngine(arguments);
  Campaign whole = LoadCampaign(arguments.config, seeds);
  CheckCases(whole, arguments.cases);
  const CampaignFolder folder(arguments.out, whole);
  const Campaign campaign = WithCases(std::move(whole), arguments.cases);
  FlyMissing(folder, campaign, arguments);
  const Json summary = WriteTables(folder, campaign);
  std::fputs((arguments.json ? summary.dump(2) + "\n" : TableOf(summary)).c_str(), stdout);
  std::fflush(stdout);
  if (const std::size_t failed = CountFailed(summary); failed > 0)
    throw SystemError(
        std::to_string(failed) + " of " + std::to_string(campaign.Missions().size()) +
        " missions failed; the table says why, and the same command tries them again");
}

void Run(const Arguments& arguments) {
  if (!arguments.mission.empty()) {
    FlyTask(arguments.out, arguments.mission);
  } else if (arguments.slurm_task > 0) {
    FlySlurmTask(arguments.out, arguments.slurm_task);
  } else if (arguments.slurm_close > 0) {
    CloseSlurmRound(arguments.out, arguments.slurm_close);
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
      "Each mission lands in DIR/CASE/SEED, the statistics in DIR/campaign.txt, campaign.json and "
      "campaign.html.\n"
      "The same command goes on where another one was stopped or killed, and flies what failed or "
      "is missing, for example further seeds or --cases. Exit status 1 when missions failed again "
      "and again.\n"
      "With --engine slurm the jobs go on without this command: Ctrl-C leaves them, the same "
      "command "
      "waits for them again.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("config", arguments->config, "campaign file (TOML)");
  command->add_option("--out", arguments->out, "the campaign's folder")->required();
  command->add_option("--seeds", arguments->seeds, "A..B instead of the file's");
  command->add_option("--cases", arguments->cases,
                      "words: only the cases that have one of them in their names");
  command
      ->add_option("--engine", arguments->engine,
                   "local: processes of this machine; slurm: job arrays of a Slurm cluster whose "
                   "nodes all see DIR")
      ->check(CLI::IsMember({"local", "slurm"}))
      ->capture_default_str();
  command
      ->add_option("--jobs", arguments->jobs,
                   "local: missions that fly at a time, default: one a processor; slurm: tasks "
                   "that run at a time, default: as many as the cluster lets")
      ->check(CLI::Range(1, 10000));
  command
      ->add_option("--per-task", arguments->per_task,
                   "slurm: missions of a task, default: 1 to 100 by the campaign's size")
      ->check(CLI::Range(1, 100000));
  command->add_option("--sbatch", arguments->sbatch,
                      "slurm: options for sbatch, as --sbatch=\"--partition=long --time=4:00:00\"");
  command->add_flag("--json", arguments->json, "print JSON");
  command->add_option("--fly", arguments->mission,
                      "CASE/SEED: fly this one mission of the campaign in DIR and nothing else, as "
                      "the processes do that the campaign starts");
  // What the jobs of --engine slurm do in a round.
  command->add_option("--slurm-task", arguments->slurm_task)->group("");
  command->add_option("--slurm-close", arguments->slurm_close)->group("");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
