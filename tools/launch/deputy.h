#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "lib/bus/bus.h"
#include "tools/launch/process_usage.h"
#include "tools/launch/procman_messages.h"
#include "tools/launch/supervised_command.h"

namespace vog {

struct DeputyOptions {
  std::string host;                      ///< Its name: orders for others are ignored.
  std::filesystem::path program_folder;  ///< Searched before PATH.
  std::filesystem::path output_folder;   ///< NAME.txt of each command.
};

/// Runs the commands that a sheriff orders, and tells how they are, over bot2-procman's messages.
/// Its commands end with it. In: PMD_ORDERS2, PMD_DISCOVER. Out: PMD_INFO2 once a second and on
/// each change, PMD_PRINTF, PMD_DISCOVER.
class Deputy {
 public:
  /// @throws SystemError when the folder for output cannot be made.
  Deputy(Bus& bus, DeputyOptions options);

  /// It has looked around for long enough.
  bool IsReady() const { return is_ready_; }
  /// Another deputy has its name: two would start everything twice.
  bool HasRival() const { return has_rival_; }

  bool IsAnyRunning() const;
  /// Stops all that runs; from now on orders are ignored.
  void StopAll();

 private:
  struct Managed {
    Managed(CommandSpec spec, const DeputyOptions& options)
        : command(std::move(spec), options.program_folder, options.output_folder) {}

    SupervisedCommand command;
    double cpu_s = 0;  // At the last report.
    float cpu_usage = 0;
    bool is_ordered = true;
  };

  void Tick(Time now);
  void LookAround(Time now);
  void OnDiscovery(Time now, const bot_procman::discovery_t& message);
  void OnOrders(Time now, const bot_procman::orders2_t& orders);
  void StopUnordered();
  void Obey(const bot_procman::sheriff_cmd2_t& order);
  void Step(std::int32_t id, Managed& managed, Time now);
  void Print(std::int32_t id, std::string text, Time now);
  void MeasureUsage(Time now);
  void PublishInfo(Time now);
  void PublishDiscovery(Time now);

  Bus& bus_;
  DeputyOptions options_;
  std::int64_t nonce_;
  std::map<std::int32_t, std::unique_ptr<Managed>> commands_;  // By the sheriff's number.
  bool is_ready_ = false, has_rival_ = false, has_changed_ = false, is_over_ = false;
  Time began_, last_discovery_, last_info_;
  MachineUsage machine_;
  float cpu_load_ = 0;
  std::size_t may_print_bytes_ = 0;
};

}  // namespace vog
