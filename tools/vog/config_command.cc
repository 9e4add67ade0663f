#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "lib/bus/lcm_bus.h"
#include "procs/controller/controller_node.h"
#include "procs/map_service/map_service_node.h"
#include "procs/nav_bridge/nav_bridge_node.h"
#include "procs/planner/planner_node.h"
#include "procs/sim/sim_node.h"
#include "procs/slam/slam_node.h"
#include "procs/sonar_reader/sonar_reader_node.h"
#include "procs/viewer/viewer_options.h"
#include "sim/scene/scene.h"
#include "tools/mission/evaluate.h"
#include "tools/mission/lock_step.h"
#include "tools/vog/commands.h"
#include "tools/vog/config_arguments.h"

namespace vog {
namespace {

struct Table {
  std::string name, heading;  ///< keep_out[0] is one of the tables [[keep_out]].
  std::vector<OptionDescription> options;
};

/// All tables with the values that `config` gives them.
class Describer {
 public:
  explicit Describer(const Config& config) : config_(config) {}

  template <class Options>
  void Add(const std::string& name) {
    Describe(name, "[" + name + "]", config_.Read<Options>(name));
  }

  /// Each of the tables [[name]]; the defaults where there is none.
  template <class Options>
  void AddEach(const std::string& name) {
    const int count = config_.CountOf(name);
    for (int i = 0; i < std::max(1, count); ++i) {
      const std::string one = name + "[" + std::to_string(i) + "]";
      Describe(one, "[[" + name + "]]", count > 0 ? config_.Read<Options>(one) : Options());
    }
  }

  const std::vector<Table>& tables() const { return tables_; }

 private:
  template <class Options>
  void Describe(const std::string& name, const std::string& heading, Options options) {
    tables_.push_back(
        {name, heading, DescribeOptions([&](OptionsVisitor& v) { options.Visit(v); })});
  }

  const Config& config_;
  std::vector<Table> tables_;
};

std::vector<Table> DescribeTables(const Config& config) {
  Describer all(config);
  all.Add<MissionOptions>("mission");
  all.Add<BusOptions>("bus");
  all.Add<WorldOptions>("simulation");
  all.Add<SceneOptions>("scene");
  all.Add<PropellerOptions>("scene.propeller");
  all.Add<TankOptions>("scene.tank");
  all.Add<PierOptions>("scene.pier");
  all.Add<WreckOptions>("scene.wreck");
  all.Add<SeafloorOptions>("scene.seafloor");
  all.Add<MineOptions>("scene.mine");
  all.Add<VehicleOptions>("vehicle");
  all.Add<CurrentOptions>("current");
  all.Add<SonarOptions>("sonar");
  all.Add<SonarModelOptions>("sonar_model");
  all.Add<DriftOptions>("drift");
  all.Add<NavBridgeOptions>("navigation");
  all.Add<DeadReckoningOptions>("dead_reckoning");
  all.Add<SensorOptions>("navigation_sensors");
  all.Add<NavigationFaultOptions>("navigation_faults");
  all.Add<RangeDetectorOptions>("range_detector");
  all.Add<SubmapOptions>("submap");
  all.Add<SensorModelOptions>("sensor_model");
  all.Add<MapOptions>("map");
  all.Add<PutInOptions>("put_in");
  all.Add<FuseOptions>("fuse");
  all.Add<IcpOptions>("registration");
  all.Add<LoopClosureOptions>("loop_closure");
  all.Add<PoseGraphOptions>("pose_graph");
  all.Add<SlamOptions>("slam");
  all.Add<ExplorationOptions>("exploration");
  all.AddEach<KeepOutOptions>("keep_out");
  all.Add<PlannerOptions>("planner");
  all.Add<ControllerOptions>("controller");
  all.Add<ViewerOptions>("viewer");
  all.Add<EvaluationOptions>("evaluation");
  all.Add<LatencyOptions>("latency");
  all.Add<LiveOptions>("live");
  all.Add<VehicleLinkOptions>("vehicle_link");
  all.Add<SonarLinkOptions>("sonar_link");
  all.Add<PressureOptions>("pressure");
  all.Add<DopplerOptions>("doppler");
  all.Add<VehicleLinkOptions>("sim_vehicle_link");
  all.Add<SonarLinkOptions>("sim_sonar_link");
  return all.tables();
}

/// As a mission file: each option with what is allowed and what it is for.
void PrintToml(const std::vector<Table>& tables) {
  for (const Table& table : tables) {
    std::printf("%s\n", table.heading.c_str());
    for (const OptionDescription& option : table.options) {
      std::printf("# %s", option.help.c_str());
      if (!option.allowed.empty()) std::printf(" (%s)", option.allowed.c_str());
      std::printf("\n%s = %s\n", option.key.c_str(), option.value.c_str());
    }
    std::printf("\n");
  }
}

void PrintJson(const std::vector<Table>& tables) {
  nlohmann::ordered_json json;
  for (const Table& table : tables)
    for (const OptionDescription& option : table.options)
      json[table.name][option.key] = {
          {"value", option.value}, {"allowed", option.allowed}, {"help", option.help}};
  std::printf("%s\n", json.dump(2).c_str());
}

struct Arguments {
  ConfigArguments config;
  bool json = false;
};

void Run(const Arguments& arguments) {
  const std::vector<Table> tables = DescribeTables(arguments.config.Load());
  if (arguments.json) {
    PrintJson(tables);
  } else {
    PrintToml(tables);
  }
}

}  // namespace

void AddConfigCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "config",
      "Every setting there is: its value, what is allowed, what it is for. The output is itself a "
      "mission file.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("file", arguments->config.file,
                      "mission file whose values to show; else defaults");
  command->add_option("--set", arguments->config.settings, "table.key=value, on top of the file");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
