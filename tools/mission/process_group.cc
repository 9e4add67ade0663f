#include "tools/mission/process_group.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/log.h"

namespace vog {
namespace {

// A program that dies this soon, so many times in a row, will not live.
constexpr double kQuickDeath_s = 2;
constexpr int kMaxQuickDeaths = 5;
constexpr double kStopTime_s = 7;

std::string HowItDied(int status) {
  if (WIFSIGNALED(status)) return std::string("killed by ") + strsignal(WTERMSIG(status));
  return "exit status " + std::to_string(WEXITSTATUS(status));
}

/// The last line that a program wrote, most often why it died.
std::string LastLine(const std::filesystem::path& file) {
  std::string text = ReadFile(file);
  while (text.ends_with('\n')) text.pop_back();
  const std::size_t start = text.rfind('\n');
  return start == std::string::npos ? text : text.substr(start + 1);
}

[[noreturn]] void Exec(const std::filesystem::path& program, const ProgramLine& line, int output) {
  // Dies with its parent, even if that is killed.
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  std::vector<char*> argv = {const_cast<char*>(line.name.c_str())};
  for (const std::string& argument : line.arguments)
    argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

}  // namespace

ProcessGroup::ProcessGroup(std::filesystem::path program_folder, std::filesystem::path log_folder)
    : program_folder_(std::move(program_folder)), log_folder_(std::move(log_folder)) {
  std::error_code error;
  std::filesystem::create_directories(log_folder_, error);
  if (error) throw SystemError(log_folder_.string() + ": cannot create: " + error.message());
}

ProcessGroup::~ProcessGroup() { Stop(); }

std::filesystem::path ProcessGroup::OutputOf(const Child& child) const {
  return log_folder_ / (child.line.name + ".txt");
}

void ProcessGroup::Spawn(Child& child) {
  const std::filesystem::path program = program_folder_ / child.line.name;
  if (::access(program.c_str(), X_OK) != 0)
    throw SystemError(program.string() + ": no such program; build everything first");
  const int output =
      ::open(OutputOf(child).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (output < 0) throw SystemError(OutputOf(child).string() + ": " + std::strerror(errno));
  child.pid = ::fork();
  if (child.pid == 0) Exec(program, child.line, output);
  ::close(output);
  if (child.pid < 0) throw SystemError(child.line.name + ": cannot start: " + std::strerror(errno));
  child.since_start = Stopwatch();
}

void ProcessGroup::Start(const ProgramLine& line) {
  Child child{line, -1, {}, 0};
  std::error_code error;
  std::filesystem::remove(OutputOf(child), error);
  Spawn(child);
  children_.push_back(std::move(child));
}

void ProcessGroup::Tend() {
  for (Child& child : children_) {
    int status = 0;
    if (::waitpid(child.pid, &status, WNOHANG) == child.pid) OnDeath(child, status);
  }
}

void ProcessGroup::OnDeath(Child& child, int status) {
  child.pid = -1;
  const bool was_quick = child.since_start.seconds() < kQuickDeath_s;
  child.quick_deaths = was_quick ? child.quick_deaths + 1 : 0;
  if (!child.line.may_restart || child.quick_deaths >= kMaxQuickDeaths)
    throw SystemError(child.line.name + ": " + HowItDied(status) + "; " + OutputOf(child).string() +
                      ": " + LastLine(OutputOf(child)));
  LogLine(child.line.name + ": " + HowItDied(status) + ", started again");
  Spawn(child);
}

void ProcessGroup::Stop() {
  for (auto child = children_.rbegin(); child != children_.rend(); ++child) {
    if (child->pid > 0) ::kill(child->pid, SIGTERM);
  }
  const Stopwatch waited;
  for (auto child = children_.rbegin(); child != children_.rend(); ++child) {
    while (child->pid > 0) {
      int status = 0;
      if (::waitpid(child->pid, &status, WNOHANG) == child->pid) {
        child->pid = -1;
      } else if (waited.seconds() > kStopTime_s) {
        ::kill(child->pid, SIGKILL);
        ::waitpid(child->pid, &status, 0);
        child->pid = -1;
      } else {
        WaitBriefly();
      }
    }
  }
  children_.clear();
}

}  // namespace vog
