#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vog {

/// A job, or an array of jobs, to submit.
struct SlurmJob {
  std::string command;        ///< A line for the shell.
  std::filesystem::path log;  ///< What it says is added there.
  int tasks = 0;              ///< Above 0: an array of tasks 1, 2, ...
  int tasks_at_a_time = 0;    ///< Of these; 0: as many as the cluster lets.
  std::string after;          ///< The job whose end, however it comes, lets this one begin.
};

/// Jobs that have not ended.
struct SlurmQueue {
  int jobs = 0;             ///< All, also those that clean up or wait for another job.
  int running = 0;          ///< Of these.
  int waiting_tasks = 0;    ///< Tasks of arrays that have not begun.
  std::string why_waiting;  ///< Of one of them, in Slurm's words: "Resources".
};

/// The jobs of one name, by Slurm's own commands (sbatch, squeue, scancel; manual pages of Slurm
/// 22.05). Each throws SystemError with the command's own words in one line.
class Slurm {
 public:
  /// `arguments` go to sbatch with each job. @throws UsageError where Slurm's commands are missing.
  Slurm(std::string job_name, std::vector<std::string> arguments);

  const std::string& job_name() const { return job_name_; }
  /// Returns the job's number.
  std::string Submit(const SlurmJob& job) const;
  SlurmQueue Queue() const;
  /// Whether somebody has cancelled the job, or tasks of it. Slurm forgets within minutes
  /// (MinJobAge).
  bool IsCancelled(const std::string& job) const;
  void CancelAll() const;

 private:
  std::string job_name_;
  std::vector<std::string> arguments_;
};

/// sbatch's words for a job.
std::vector<std::string> SbatchWords(const std::string& job_name,
                                     const std::vector<std::string>& arguments,
                                     const SlurmJob& job);

/// The job's number in what `sbatch --parsable` said, "123" or "123;cluster", among what a site's
/// plugins say.
std::optional<std::string> JobNumberIn(std::string_view said);

/// Reads what squeue said in the format of Slurm::Queue(), among what a site's plugins say.
SlurmQueue ParseQueue(std::string_view said);

/// A command's complaint on one line, without its name and rank.
std::string ComplaintIn(std::string_view said);

/// One word for the shell.
std::string ShellQuoted(const std::string& word);

/// Which Slurm job this process is in and how often that was begun before, as "123.0"; empty
/// outside of jobs.
std::string SlurmAttempt();

}  // namespace vog
