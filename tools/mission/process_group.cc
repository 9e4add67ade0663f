#include "tools/mission/process_group.h"

#include <signal.h>

#include "lib/base/errors.h"
#include "lib/base/log.h"

namespace vog {
namespace {

// A program that dies this soon, so many times in a row, will not live.
constexpr double kQuickDeath_s = 2;
constexpr int kMaxQuickDeaths = 5;
constexpr double kStopTime_s = 7;

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
  ChildCommand command{program_folder_ / child.line.name, {child.line.name}, {}};
  command.argv.insert(command.argv.end(), child.line.arguments.begin(), child.line.arguments.end());
  child.process = ChildProcess(command, OutputOf(child));
  child.since_start = Stopwatch();
}

void ProcessGroup::Start(const ProgramLine& line) {
  Child child{line, {}, {}, 0};
  std::error_code error;
  std::filesystem::remove(OutputOf(child), error);
  Spawn(child);
  children_.push_back(std::move(child));
}

void ProcessGroup::Tend() {
  for (Child& child : children_) {
    if (const auto status = child.process->Ended()) OnDeath(child, *status);
  }
}

void ProcessGroup::OnDeath(Child& child, int status) {
  const bool was_quick = child.since_start.seconds() < kQuickDeath_s;
  child.quick_deaths = was_quick ? child.quick_deaths + 1 : 0;
  if (!child.line.may_restart || child.quick_deaths >= kMaxQuickDeaths)
    throw SystemError(child.line.name + ": " + HowItEnded(status) + "; " +
                      OutputOf(child).string() + ": " + LastLine(OutputOf(child)));
  LogLine(child.line.name + ": " + HowItEnded(status) + ", started again");
  Spawn(child);
}

void ProcessGroup::Stop() {
  for (auto child = children_.rbegin(); child != children_.rend(); ++child)
    child->process->Signal(SIGTERM);
  const Stopwatch waited;
  for (auto child = children_.rbegin(); child != children_.rend(); ++child)
    while (!child->process->Ended() && waited.seconds() < kStopTime_s) WaitBriefly();
  children_.clear();
}

}  // namespace vog
