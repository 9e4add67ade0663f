#include "tools/launch/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/bus/stopwatch.h"

namespace vog {
namespace {

/// What execve() needs, made before the fork: after it nothing may allocate.
struct ExecArguments {
  std::vector<std::string> environment;
  std::vector<char*> argv, envp;

  explicit ExecArguments(const ChildCommand& command) : environment(command.environment) {
    for (const std::string& word : command.argv) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    // The first of a name counts.
    for (std::string& entry : environment) envp.push_back(entry.data());
    for (char** entry = environ; *entry != nullptr; ++entry) envp.push_back(*entry);
    envp.push_back(nullptr);
  }
};

[[noreturn]] void Exec(const char* program, const ExecArguments& arguments, int output,
                       pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(127);  // It died before it could be watched.
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  ::close_range(STDERR_FILENO + 1, ~0U, 0);  // LCM's sockets would fill and never be read.
  ::execve(program, arguments.argv.data(), arguments.envp.data());
  ::_exit(127);
}

/// A descriptor that closes itself.
struct OpenFile {
  int fd;
  explicit OpenFile(const std::filesystem::path& path)
      : OpenFile(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644),
                 path.string()) {}
  OpenFile(int opened, const std::string& name) : fd(opened) {
    if (fd < 0) throw SystemError(name + ": " + std::strerror(errno));
  }
  ~OpenFile() { ::close(fd); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
};

}  // namespace

ChildProcess::ChildProcess(const ChildCommand& command, int output) {
  if (::access(command.program.c_str(), X_OK) != 0)
    throw SystemError(command.program.string() + ": no such program; build everything first");
  const ExecArguments arguments(command);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) Exec(command.program.c_str(), arguments, output, parent);
  if (pid_ < 0) throw SystemError(command.argv.front() + ": cannot start: " + std::strerror(errno));
  ::setpgid(pid_, pid_);  // Here too, so that it holds whichever runs first.
}

ChildProcess::ChildProcess(const ChildCommand& command, const std::filesystem::path& output)
    : ChildProcess(command, OpenFile(output).fd) {}

ChildProcess::~ChildProcess() {
  if (pid_ < 0 || Ended()) return;
  Signal(SIGKILL);
  int status = 0;
  ::waitpid(pid_, &status, 0);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), status_(other.status_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(status_, other.status_);
  return *this;
}

std::optional<int> ChildProcess::Ended() {
  siginfo_t info{};
  if (status_ ||
      ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
      info.si_pid != pid_)
    return status_;
  ::kill(-pid_, SIGKILL);  // While its number is still its own: what it has started and left.
  int status = 0;
  if (::waitpid(pid_, &status, 0) == pid_) status_ = status;
  return status_;
}

void ChildProcess::Signal(int number) {
  if (!Ended()) ::kill(-pid_, number);
}

EndedProgram RunToItsEnd(const ChildCommand& command) {
  const OpenFile output(::memfd_create("output", MFD_CLOEXEC), "output");
  ChildProcess process(command, output.fd);
  std::optional<int> status;
  while (!(status = process.Ended())) WaitBriefly();
  return {*status, ReadFile("/proc/self/fd/" + std::to_string(output.fd))};
}

std::filesystem::path ProgramFolder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::string HowItEnded(int status) {
  if (WIFSIGNALED(status)) return std::string("killed by ") + strsignal(WTERMSIG(status));
  return "exit status " + std::to_string(WEXITSTATUS(status));
}

std::string LastLine(const std::filesystem::path& file) {
  std::string text = ReadFile(file);
  while (text.ends_with('\n')) text.pop_back();
  const std::size_t start = text.rfind('\n');
  return start == std::string::npos ? text : text.substr(start + 1);
}

}  // namespace vog
