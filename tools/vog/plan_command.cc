#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/plan/plan_bench.h"
#include "tools/vog/commands.h"
#include "tools/vog/config_arguments.h"

namespace vog {
namespace {

struct PlanBenchArguments {
  PlanBenchOptions options;
  ConfigArguments config;
  bool json = false;
};

void Bench(const PlanBenchArguments& arguments) {
  const auto rows = RunPlanBench(arguments.options, arguments.config.Load());
  if (arguments.json) {
    nlohmann::ordered_json json = {{"rows", nlohmann::ordered_json::array()}};
    for (const PlanBenchRow& row : rows)
      json["rows"].push_back({{"planner", row.planner},
                              {"submaps", row.submaps},
                              {"plans", row.plans},
                              {"paths", row.paths},
                              {"median_ms", row.median_ms},
                              {"worst_ms", row.worst_ms}});
    std::printf("%s\n", json.dump(2).c_str());
    return;
  }
  std::printf("%-10s %8s %7s %7s %11s %10s\n", "planner", "submaps", "plans", "paths", "median, ms",
              "worst, ms");
  for (const PlanBenchRow& row : rows)
    std::printf("%-10s %8d %7d %7d %11.1f %10.1f\n", row.planner.c_str(), row.submaps, row.plans,
                row.paths, row.median_ms, row.worst_ms);
}

}  // namespace

void AddPlanCommand(CLI::App& app) {
  auto* plan = app.add_subcommand("plan", "Planners of views on saved maps.");
  plan->require_subcommand(1);
  auto* bench = plan->add_subcommand(
      "bench",
      "How long a planning step takes, against the number of submaps: each planner flies along a "
      "map, its submaps come one by one, and from the base of each it plans.");
  const auto arguments = std::make_shared<PlanBenchArguments>();
  bench->add_option("map", arguments->options.map, "the map's folder")->required();
  bench->add_option("--config", arguments->config.file, "mission file with the box and the sonar");
  bench->add_option("--set", arguments->config.settings, "table.key=value, on top of the file");
  bench->add_option("--submaps", arguments->options.submaps, "sizes of the map")->delimiter(',');
  bench
      ->add_option("--plans", arguments->options.plans,
                   "for each size: the last steps that led up to it")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  bench->add_flag("--json", arguments->json, "print JSON");
  bench->callback([arguments] { Bench(*arguments); });
}

}  // namespace vog
