#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "lib/base/time.h"
#include "tools/launch/child_output.h"
#include "tools/launch/child_process.h"
#include "tools/launch/pmd_file.h"

namespace vog {

/// A command of a deputy: started, stopped and started again as procman orders it. A run has a
/// number, so that an order that arrives twice starts nothing twice.
class SupervisedCommand {
 public:
  SupervisedCommand(CommandSpec spec, std::filesystem::path program_folder,
                    const std::filesystem::path& output_folder);

  /// Also changes what is to be executed, from its next start on.
  void Order(const CommandSpec& spec, int desired_run, bool force_quit);

  /// Starts, stops, signals and restarts what is due. Returns what the command has said since and
  /// what became of it, in lines. To be called every few milliseconds.
  std::string Step(Time now);

  const CommandSpec& spec() const { return spec_; }
  bool IsRunning() const { return process_.has_value(); }
  /// 0 when it does not run.
  int pid() const { return process_ ? process_->pid() : 0; }
  int actual_run() const { return actual_run_; }
  /// As waitpid() tells, of the last run that has ended.
  int exit_status() const { return exit_status_; }
  /// Why it is not started again until a new run is ordered: it cannot be, or died so often so
  /// soon. Empty: that is not so.
  const std::string& given_up() const { return given_up_; }

 private:
  /// Run 0 asks for nothing: a sheriff that has just come leaves running what runs.
  bool MustStop() const {
    return force_quit_ || (desired_run_ != 0 && desired_run_ != actual_run_);
  }
  std::string Start(Time now);
  std::string OnEnd(int status, Time now);
  std::string StartAgain(Time now);
  void Stop(Time now);

  CommandSpec spec_;
  std::filesystem::path program_folder_;
  ChildOutput output_;
  std::optional<ChildProcess> process_;
  int desired_run_ = 0, actual_run_ = 0;
  bool force_quit_ = false;
  int exit_status_ = 0;
  Time started_;
  std::optional<Time> stopping_since_;
  std::optional<Time> respawn_at_;
  int quick_deaths_ = 0;
  std::string given_up_;
};

}  // namespace vog
