#include "tools/launch/launch.h"

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <optional>

#include "lib/base/errors.h"
#include "lib/base/log.h"
#include "lib/bus/process.h"
#include "lib/bus/stopwatch.h"
#include "tools/launch/deputy.h"
#include "tools/launch/sheriff.h"

namespace vog {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(20);
// For commands on other machines, whose deputies may be dead; and again for those here.
constexpr double kMaxStop_s = 60;

std::string HostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// For the commands' lines, unless the operator has set them.
void SetVariables(const LaunchOptions& options) {
  const auto folder = std::filesystem::absolute(options.file).parent_path().parent_path();
  ::setenv("VOG_CONFIG", folder.c_str(), /*overwrite=*/0);
  ::setenv("VOG_OUT", std::filesystem::absolute(options.output_folder).c_str(), /*overwrite=*/0);
}

Script FirstScript(const PmdFile& file, const std::string& name) {
  if (const Script* script = file.FindScript(name.empty() ? "start" : name)) return *script;
  if (!name.empty()) throw UsageError("there is no script \"" + name + '"');
  ScriptAction everything;
  everything.await = AwaitedStatus::kRunning;
  return {"start", {everything}};
}

/// A deputy and maybe a sheriff on one bus.
class Launcher {
 public:
  explicit Launcher(const LaunchOptions& options)
      : options_(options), bus_(At(options.url)), deputy_(bus_, Of(options)) {}

  void WaitUntilAlone(const std::atomic<bool>& stop) {
    while (!deputy_.IsReady() && !stop) Step();
    if (deputy_.HasRival())
      throw SystemError("a deputy of the name \"" + Of(options_).host +
                        "\" runs already; stop it, or choose another name with --deputy");
  }

  /// @pre it is alone: another deputy of its name would take the orders for its own.
  void Start(const PmdFile& file, const Script& script, const std::atomic<bool>& stop) {
    sheriff_.emplace(bus_, file, Of(options_).host);
    sheriff_->Run(script);
    const Stopwatch waited;
    while (!sheriff_->IsIdle() && !stop) {
      Step();
      const std::string reason = sheriff_->hopeless();
      if (!reason.empty())
        throw SystemError(reason + "; output is in " + options_.output_folder.string());
      if (waited.seconds() > options_.ready_timeout_s)
        throw SystemError("gave up waiting for " + sheriff_->waits_for() + "; output is in " +
                          options_.output_folder.string());
    }
  }

  void StopAll() {
    if (sheriff_) sheriff_->StopInOrder();
    const Stopwatch waited;
    while (sheriff_ && !sheriff_->IsIdle() && waited.seconds() < kMaxStop_s) Step();
    deputy_.StopAll();
    const Stopwatch stopping;
    while (deputy_.IsAnyRunning() && stopping.seconds() < kMaxStop_s) Step();
  }

  void Step() {
    bus_.RunFor(kStep);
    if (!sheriff_) return;
    for (const std::string& line : sheriff_->TakeNews()) LogLine(line);
  }

 private:
  static BusOptions At(const std::string& url) {
    BusOptions options;
    options.url = url;
    return options;
  }
  static DeputyOptions Of(const LaunchOptions& options) {
    return {options.deputy.empty() ? HostName() : options.deputy, ProgramFolder(),
            options.output_folder};
  }

  LaunchOptions options_;
  LcmBus bus_;
  Deputy deputy_;
  std::optional<Sheriff> sheriff_;
};

}  // namespace

void Launch(const LaunchOptions& options) {
  std::optional<PmdFile> file;
  std::optional<Script> script;
  if (!options.file.empty()) {
    file = ReadPmd(options.file);
    script = FirstScript(*file, options.script);
    SetVariables(options);
  }
  const std::atomic<bool>& stop = StopSignal();
  Launcher launcher(options);
  launcher.WaitUntilAlone(stop);
  try {
    if (script && !stop) launcher.Start(*file, *script, stop);
    if (!stop) LogLine("all is started; Ctrl-C stops it");
    while (!stop) launcher.Step();
  } catch (const SystemError&) {
    launcher.StopAll();
    throw;
  }
  launcher.StopAll();
}

}  // namespace vog
