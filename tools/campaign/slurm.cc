#include "tools/campaign/slurm.h"

#include <cstdlib>
#include <sstream>

#include "lib/base/errors.h"
#include "tools/launch/child_process.h"
#include "tools/launch/command_line.h"

namespace vog {
namespace {

// Before lines that are squeue's own. %K: the array's task or N/A.
constexpr std::string_view kMark = "vog|";
constexpr const char* kQueueFormat = "--format=vog|%K|%T|%r";

std::filesystem::path Find(const std::string& program) {
  if (const auto found = FindInPath(program)) return *found;
  throw UsageError(program +
                   ": no such program in PATH; --engine slurm needs a Slurm cluster's "
                   "login node, --engine local does without");
}

EndedProgram Run(const std::string& program, std::vector<std::string> words) {
  words.insert(words.begin(), program);
  // Jobs that are submitted by a job would hear of its restarts.
  return RunToItsEnd({Find(program), words, {"SLURM_RESTART_COUNT=0"}});
}

/// @throws SystemError when it fails.
std::string Ask(const std::string& program, const std::vector<std::string>& words) {
  const EndedProgram ended = Run(program, words);
  if (ended.status == 0) return ended.said;
  const std::string complaint = ComplaintIn(ended.said);
  throw SystemError(program + ": " + (complaint.empty() ? HowItEnded(ended.status) : complaint));
}

std::vector<std::string> Split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in{std::string(text)};
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

/// A path in which sbatch finds no pattern.
std::string Literally(const std::string& path) {
  std::string literal;
  for (const char c : path) literal += c == '%' ? "%%" : std::string(1, c);
  return literal;
}

}  // namespace

Slurm::Slurm(std::string job_name, std::vector<std::string> arguments)
    : job_name_(std::move(job_name)), arguments_(std::move(arguments)) {
  for (const char* program : {"sbatch", "squeue", "scancel"}) Find(program);
}

std::string Slurm::Submit(const SlurmJob& job) const {
  const std::string said = Ask("sbatch", SbatchWords(job_name_, arguments_, job));
  if (const auto number = JobNumberIn(said)) return *number;
  throw SystemError("sbatch: told no job's number but '" + ComplaintIn(said) + "'");
}

SlurmQueue Slurm::Queue() const {
  return ParseQueue(Ask("squeue", {"--name=" + job_name_, "--array", "--noheader", kQueueFormat}));
}

bool Slurm::IsCancelled(const std::string& job) const {
  const EndedProgram ended =
      Run("squeue", {"--jobs=" + job, "--states=CANCELLED", "--noheader", kQueueFormat});
  return ended.status == 0 && ParseQueue(ended.said).jobs > 0;
}

void Slurm::CancelAll() const { Ask("scancel", {"--name=" + job_name_}); }

std::vector<std::string> SbatchWords(const std::string& job_name,
                                     const std::vector<std::string>& arguments,
                                     const SlurmJob& job) {
  // First, so that sbatch refuses a script among the arguments instead of submitting it. A job
  // whose node is lost begins again, unless the user says --no-requeue.
  std::vector<std::string> words = {"--wrap=" + job.command, "--requeue"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::string log = Literally(job.log.string());
  words.insert(words.end(), {"--parsable", "--job-name=" + job_name, "--output=" + log,
                             "--error=" + log, "--open-mode=append"});
  if (job.tasks > 0) {
    std::string tasks = "--array=1-" + std::to_string(job.tasks);
    if (job.tasks_at_a_time > 0) tasks += "%" + std::to_string(job.tasks_at_a_time);
    words.push_back(tasks);
  }
  if (!job.after.empty()) words.push_back("--dependency=afterany:" + job.after);
  return words;
}

std::optional<std::string> JobNumberIn(std::string_view said) {
  std::optional<std::string> number;
  for (const std::string& line : Split(said, '\n')) {
    const std::string candidate = line.substr(0, line.find(';'));
    if (!candidate.empty() && candidate.find_first_not_of("0123456789") == std::string::npos)
      number = candidate;
  }
  return number;
}

SlurmQueue ParseQueue(std::string_view said) {
  SlurmQueue queue;
  for (const std::string& line : Split(said, '\n')) {
    if (!line.starts_with(kMark)) continue;
    const std::vector<std::string> fields = Split(line.substr(kMark.size()), '|');
    if (fields.size() < 3) continue;
    const std::string &task = fields[0], &state = fields[1], &reason = fields[2];
    ++queue.jobs;
    if (state == "PENDING" && task != "N/A") {
      ++queue.waiting_tasks;
      queue.why_waiting = reason;
    } else if (state != "PENDING" && state != "COMPLETING") {
      ++queue.running;
    }
  }
  return queue;
}

std::string ComplaintIn(std::string_view said) {
  std::string complaint;
  for (const std::string& line : Split(said, '\n')) {
    const std::size_t rank = line.find("error: ");
    const std::string words = rank == std::string::npos ? line : line.substr(rank + 7);
    if (words.empty()) continue;
    complaint += (complaint.empty() ? "" : "; ") + words;
  }
  return complaint;
}

std::string ShellQuoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string SlurmAttempt() {
  const char* job = std::getenv("SLURM_JOB_ID");
  const char* restarts = std::getenv("SLURM_RESTART_COUNT");
  return job == nullptr ? "" : std::string(job) + "." + (restarts == nullptr ? "0" : restarts);
}

}  // namespace vog
