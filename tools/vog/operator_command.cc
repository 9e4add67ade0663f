#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

constexpr Duration kPatience = std::chrono::seconds(5);

struct OperatorArguments {
  std::string url = BusOptions().url;
  std::vector<std::string> settings;
  std::string file;
};

/// Waits, while the bus runs, until the planner has said what `is_it` looks for.
template <class IsIt>
bool WaitFor(LcmBus& bus, const std::optional<mission_status_t>& heard, IsIt is_it) {
  constexpr Duration kStep = std::chrono::milliseconds(50);
  for (Duration waited{}; waited < kPatience; waited += kStep) {
    bus.RunFor(kStep);
    if (heard && is_it(*heard)) return true;
  }
  return false;
}

void SendOrder(const std::string& command, const OperatorArguments& arguments) {
  Config config = arguments.file.empty() ? Config() : Config::Load(arguments.file);
  for (const std::string& setting : arguments.settings) config.Set(setting);
  BusOptions options;
  options.url = arguments.url;
  LcmBus bus(options);
  Endpoint endpoint(bus, "operator", /*run_id=*/0);
  std::optional<mission_status_t> heard;
  endpoint.Subscribe(outputs::kMissionStatus,
                     [&](Time, const mission_status_t& status) { heard = status; });
  if (!WaitFor(bus, heard, [](const mission_status_t&) { return true; }))
    throw SystemError("no MISSION_STATUS is heard on " + arguments.url +
                      ": does vog-planner run there?");
  const std::int64_t before = heard->orders;
  operator_command_t order{};
  order.command = command;
  order.settings = config.ToToml();
  endpoint.Publish(outputs::kOperator, order, TimeOf(heard->header));
  if (!WaitFor(bus, heard, [&](const mission_status_t& s) { return s.orders > before; }))
    throw SystemError("vog-planner does not answer");
  if (!heard->refused.empty()) throw SystemError("refused: " + heard->refused);
  std::printf("%s%s\n", heard->state.c_str(),
              heard->hold.empty() ? "" : (", holding: " + heard->hold).c_str());
}

}  // namespace

void AddOperatorCommand(CLI::App& app) {
  auto* group = app.add_subcommand(
      "operator", "Orders to a mission under way, by the message OPERATOR to vog-planner.");
  group->require_subcommand(1);
  const auto arguments = std::make_shared<OperatorArguments>();
  const auto add = [&](const std::string& name, const char* help) {
    auto* command = group->add_subcommand(name, help);
    command->add_option("--url", arguments->url, "LCM provider")->capture_default_str();
    command->callback([name, arguments] { SendOrder(name, *arguments); });
    return command;
  };
  add("pause", "stay where you are");
  add("resume", "go on");
  add("go_home", "end the exploration, go home and save the map");
  add("abort", "end the mission here and save the map");
  auto* set = add(
      "set", "change the exploration box, keep-out boxes, depth, home or the planner's options");
  set->add_option("settings", arguments->settings,
                  "like exploration.max_depth_m=3 or planner.clearance_m=0.3");
  set->add_option("--file", arguments->file,
                  "TOML with tables [exploration], [[keep_out]] (instead of all those before) and "
                  "[planner]");
}

}  // namespace vog
