#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vog {

/// What to start.
struct ChildCommand {
  std::filesystem::path program;
  std::vector<std::string> argv;         ///< Its name first.
  std::vector<std::string> environment;  ///< NAME=value, besides this process's own.
};

/// A program that runs beside this one, without input. It dies with this process, however that
/// ends, and what it has started and not released into a session of its own dies with it. Ctrl-C
/// reaches this process alone.
class ChildProcess {
 public:
  /// What it says goes to the descriptor `output`, which stays the caller's. @throws SystemError
  /// when there is no such program or it cannot be started.
  ChildProcess(const ChildCommand& command, int output);
  /// What it says is added to a file.
  ChildProcess(const ChildCommand& command, const std::filesystem::path& output);
  /// Kills it and those that it started, unless it has ended.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  /// The status that waitpid() tells, once it has ended.
  std::optional<int> Ended();
  int pid() const { return pid_; }
  /// Sends a signal, unless it has ended.
  void Signal(int number);

 private:
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// A program that has ended.
struct EndedProgram {
  int status;        ///< As waitpid() tells it.
  std::string said;  ///< On both its outputs.
};

/// Runs a program to its end. @throws SystemError when it cannot be started.
EndedProgram RunToItsEnd(const ChildCommand& command);

/// The folder of the program that runs, where its companions are.
std::filesystem::path ProgramFolder();

/// "exit status 1" or "killed by Killed".
std::string HowItEnded(int status);

/// The last line of a program's output, most often why it ended.
std::string LastLine(const std::filesystem::path& file);

}  // namespace vog
