#include "tools/launch/supervised_command.h"

#include <signal.h>

#include <algorithm>

#include "lib/base/errors.h"
#include "tools/launch/command_line.h"

namespace vog {
namespace {

// A program that dies this soon, so many times in a row, will not live.
constexpr Duration kQuickDeath = std::chrono::seconds(2);
constexpr int kMaxQuickDeaths = 20;
constexpr Duration kFirstBackoff = std::chrono::milliseconds(10);
constexpr Duration kLongestBackoff = std::chrono::seconds(1);

/// Twice as long after each quick death, as procman waits.
Duration BackoffAfter(int quick_deaths) {
  Duration backoff = kFirstBackoff;
  for (int i = 1; i < quick_deaths && backoff < kLongestBackoff; ++i) backoff *= 2;
  return std::min(backoff, kLongestBackoff);
}

}  // namespace

SupervisedCommand::SupervisedCommand(CommandSpec spec, std::filesystem::path program_folder,
                                     const std::filesystem::path& output_folder)
    : spec_(std::move(spec)),
      program_folder_(std::move(program_folder)),
      output_(output_folder / (spec_.name + ".txt")) {}

void SupervisedCommand::Order(const CommandSpec& spec, int desired_run, bool force_quit) {
  spec_ = spec;
  force_quit_ = force_quit;
  if (desired_run == desired_run_) return;
  desired_run_ = desired_run;
  quick_deaths_ = 0;
  given_up_.clear();
  respawn_at_.reset();
}

std::string SupervisedCommand::Step(Time now) {
  std::string said = output_.Read();
  if (process_) {
    if (const auto status = process_->Ended()) {
      said += output_.Read() + OnEnd(*status, now);
    } else if (MustStop()) {
      Stop(now);
    }
  }
  if (process_ || force_quit_ || desired_run_ == 0) return said;
  const bool is_new = desired_run_ != actual_run_;
  const bool is_due = respawn_at_ && now >= *respawn_at_;
  if (is_new || is_due) said += Start(now);
  return said;
}

std::string SupervisedCommand::Start(Time now) {
  respawn_at_.reset();
  actual_run_ = desired_run_;
  started_ = now;
  constexpr int kNotFound = 127 << 8;  // As a shell says it.
  try {
    process_.emplace(ParseExec(spec_.exec, program_folder_), output_.child_fd());
    return "";
  } catch (const UsageError& error) {
    exit_status_ = kNotFound;
    given_up_ = error.what();
    return spec_.name + ": " + given_up_ + "\n";
  } catch (const SystemError& error) {
    exit_status_ = kNotFound;
    return spec_.name + ": " + error.what() + StartAgain(now);
  }
}

std::string SupervisedCommand::OnEnd(int status, Time now) {
  process_.reset();
  exit_status_ = status;
  const bool was_stopped = stopping_since_.has_value();
  stopping_since_.reset();
  const std::string line = spec_.name + ": " + HowItEnded(status);
  return line + (was_stopped || MustStop() ? "\n" : StartAgain(now));
}

std::string SupervisedCommand::StartAgain(Time now) {
  if (!spec_.auto_respawn) return "\n";
  quick_deaths_ = now - started_ < kQuickDeath ? quick_deaths_ + 1 : 0;
  if (quick_deaths_ >= kMaxQuickDeaths) {
    given_up_ = std::to_string(quick_deaths_) + " quick deaths in a row";
    return ", given up after " + given_up_ + "\n";
  }
  respawn_at_ = now + BackoffAfter(quick_deaths_);
  return ", started again\n";
}

void SupervisedCommand::Stop(Time now) {
  if (!stopping_since_) {
    stopping_since_ = now;
    process_->Signal(spec_.stop_signal);
  } else if (now - *stopping_since_ > FromSeconds(spec_.stop_time_allowed_s)) {
    process_->Signal(SIGKILL);
  }
}

}  // namespace vog
