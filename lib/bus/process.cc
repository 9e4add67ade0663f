#include "lib/bus/process.h"

#include <CLI/CLI.hpp>
#include <csignal>
#include <memory>
#include <vector>

#include "lib/base/config_tables.h"
#include "lib/base/log.h"

namespace vog {
namespace {

std::atomic<bool> stop = false;

int Run(const ProcessDescription& description, int argc, char** argv,
        const std::function<std::shared_ptr<void>(LcmBus&, const Config&)>& start) {
  CLI::App app(description.purpose, description.name);
  std::string file;
  std::vector<std::string> settings;
  app.add_option("--config", file, "mission file (TOML)")->required();
  app.add_option("--set", settings, "table.key=value, on top of the file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + "; see --help");
  }
  Config config = Config::Load(file);
  for (const std::string& setting : settings) config.Set(setting);
  config.RejectUnknownTables(kConfigTables);
  BusOptions options = config.Read<BusOptions>("bus");
  if (description.is_time_source) options.clock = ClockSource::kSystem;
  LcmBus bus(options);
  const std::shared_ptr<void> node = start(bus, config);
  bus.Run(StopSignal());
  bus.Flush();
  return 0;
}

}  // namespace

const std::atomic<bool>& StopSignal() {
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
  return stop;
}

int RunProcess(const ProcessDescription& description, int argc, char** argv,
               const std::function<std::shared_ptr<void>(LcmBus&, const Config&)>& start) {
  return RunMain([&] { return Run(description, argc, argv, start); });
}

}  // namespace vog
