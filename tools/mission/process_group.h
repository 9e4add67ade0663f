#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/bus/stopwatch.h"
#include "tools/launch/child_process.h"

namespace vog {

/// A program of the system and its arguments.
struct ProgramLine {
  std::string name;
  std::vector<std::string> arguments;
  bool may_restart = true;  ///< Started again when it dies.
};

/// Child processes that are kept running until they are stopped. Their output goes to files. They
/// die with this process, however that ends.
class ProcessGroup {
 public:
  /// Programs are found in `program_folder`; NAME.txt of each is written to `log_folder`.
  ProcessGroup(std::filesystem::path program_folder, std::filesystem::path log_folder);
  ~ProcessGroup();
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;

  /// @throws SystemError when it cannot be started.
  void Start(const ProgramLine& line);

  /// Starts again what has died. @throws SystemError when a program that may not restart has died,
  /// or one dies again and again; the message tells how, and where its output is.
  void Tend();

  /// SIGTERM to all in the opposite order of their start, SIGKILL to those that do not go.
  void Stop();

 private:
  struct Child {
    ProgramLine line;
    std::optional<ChildProcess> process;
    Stopwatch since_start;
    int quick_deaths = 0;
  };

  void Spawn(Child& child);
  void OnDeath(Child& child, int status);
  std::filesystem::path OutputOf(const Child& child) const;

  std::filesystem::path program_folder_, log_folder_;
  std::vector<Child> children_;  // In order of their start.
};

}  // namespace vog
