#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vog {

/// A program that runs beside this one, its output in a file. It dies with this process, however
/// that ends; Ctrl-C reaches this process alone.
class ChildProcess {
 public:
  /// Starts `program` under the name `name`; what it says is added to `output`. @throws SystemError
  /// when there is no such program or it cannot be started.
  ChildProcess(const std::filesystem::path& program, const std::string& name,
               const std::vector<std::string>& arguments, const std::filesystem::path& output);
  /// Kills it and those that it started, unless it has ended.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  /// The status that waitpid() tells, once it has ended.
  std::optional<int> Ended();
  /// Sends a signal, unless it has ended.
  void Signal(int number);

 private:
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// "exit status 1" or "killed by Killed".
std::string HowItEnded(int status);

/// The last line of a program's output, most often why it ended.
std::string LastLine(const std::filesystem::path& file);

}  // namespace vog
