#include "lib/bus/process.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "lib/base/config_tables.h"
#include "lib/base/files.h"
#include "lib/base/log.h"

namespace vog {
namespace {

std::atomic<bool> stop = false;

/// Keeps a second process of the same name from the same bus: the name of a socket that nobody
/// talks to, which the kernel takes back however the process ends.
class SoleInstance {
 public:
  SoleInstance(const std::string& process, const BusOptions& bus)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    // What follows the question mark tells how to reach a bus, not which.
    const std::string bus_name = bus.url.substr(0, bus.url.find('?')) + " " + bus.channel_prefix;
    // A leading zero: a name that is no file.
    const std::string name = '\0' + process + " " + std::to_string(Crc32(bus_name));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::size_t size = std::min(name.size(), sizeof(address.sun_path));
    std::copy_n(name.begin(), size, address.sun_path);
    const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + size);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), bytes) != 0 &&
        errno == EADDRINUSE) {
      ::close(socket_);
      throw SystemError("one runs already on the bus " + bus.url + "; not started");
    }
  }
  ~SoleInstance() { ::close(socket_); }
  SoleInstance(const SoleInstance&) = delete;
  SoleInstance& operator=(const SoleInstance&) = delete;

 private:
  int socket_;
};

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
  std::optional<SoleInstance> sole;
  if (!description.may_be_many) sole.emplace(description.name, options);
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
