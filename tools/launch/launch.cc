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
// For each command the time that its stop is allowed, and this for all else.
constexpr double kMaxStop_s = 60;

std::string HostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::filesystem::path ProgramFolder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
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
  Launcher(const LaunchOptions& options, std::optional<PmdFile> file)
      : options_(options), bus_(At(options.url)), deputy_(bus_, Of(options)) {
    if (file) sheriff_.emplace(bus_, std::move(*file), Of(options).host);
  }

  void WaitUntilAlone(const std::atomic<bool>& stop) {
    while (!deputy_.IsReady() && !stop) Step();
    if (deputy_.HasRival())
      throw SystemError("a deputy of the name \"" + Of(options_).host +
                        "\" runs already; stop it, or choose another name with --deputy");
  }

  void Start(const Script& script, const std::atomic<bool>& stop) {
    sheriff_->Run(script);
    const Stopwatch waited;
    while (!sheriff_->IsIdle() && !stop) {
      Step();
      if (waited.seconds() > options_.ready_timeout_s)
        throw SystemError("gave up waiting for " + sheriff_->waits_for() + "; output is in " +
                          options_.output_folder.string());
    }
  }

  void StopAll() {
    if (sheriff_) sheriff_->StopInOrder();
    const Stopwatch waited;
    while (sheriff_ && !(sheriff_->IsIdle() && !deputy_.IsAnyRunning()) &&
           waited.seconds() < kMaxStop_s)
      Step();
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
  Launcher launcher(options, file);
  launcher.WaitUntilAlone(stop);
  try {
    if (script) launcher.Start(*script, stop);
    if (!stop) LogLine("all is started; Ctrl-C stops it");
    while (!stop) launcher.Step();
  } catch (const SystemError&) {
    launcher.StopAll();
    throw;
  }
  launcher.StopAll();
}

}  // namespace vog
