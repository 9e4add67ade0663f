#include "tools/campaign/local_engine.h"

#include <sys/wait.h>

#include <deque>
#include <fstream>

#include "lib/base/errors.h"
#include "lib/bus/process.h"
#include "lib/bus/stopwatch.h"
#include "tools/launch/child_process.h"
#include "tools/mission/progress_bar.h"

namespace vog {
namespace {

class LocalEngine {
 public:
  LocalEngine(const CampaignFolder& folder, const std::vector<MissionId>& missions, int attempts)
      : folder_(folder), missions_(missions.size()), attempts_(attempts) {
    for (const MissionId& mission : missions) waiting_.push_back({mission, 0});
  }

  void Fly(int jobs) {
    const std::atomic<bool>& stop = StopSignal();
    while (!waiting_.empty() || !flying_.empty()) {
      if (stop) throw SystemError(folder_.path().string() + ": stopped; the same command goes on");
      while (!waiting_.empty() && flying_.size() < static_cast<std::size_t>(jobs)) StartNext();
      TakeEnded();
      Show();
      WaitBriefly();
    }
  }

 private:
  struct Task {
    MissionId mission;
    int attempts = 0;
  };
  struct Flight {
    Task task;
    ChildProcess process;
  };

  void StartNext() {
    Task task = waiting_.front();
    waiting_.pop_front();
    ++task.attempts;
    const std::filesystem::path output = folder_.OutputOf(task.mission);
    std::filesystem::remove(output);
    const ChildCommand command{
        "/proc/self/exe",
        {"vog", "campaign", "--out", folder_.path().string(), "--fly", task.mission.text()},
        {}};
    flying_.push_back({task, ChildProcess(command, output)});
  }

  void TakeEnded() {
    for (auto flight = flying_.begin(); flight != flying_.end();) {
      const auto status = flight->process.Ended();
      if (!status) {
        ++flight;
        continue;
      }
      OnEnded(flight->task, *status);
      flight = flying_.erase(flight);
    }
  }

  void OnEnded(const Task& task, int status) {
    const std::filesystem::path output = folder_.OutputOf(task.mission);
    if (folder_.IsFinished(task.mission)) {
      ++finished_;
      std::filesystem::remove(output);
      return;
    }
    // A process that was killed could not say so itself.
    if (!WIFEXITED(status) || !std::filesystem::exists(output) || LastLine(output).empty())
      std::ofstream(output, std::ios::app) << HowItEnded(status) << "\n";
    if (task.attempts < attempts_) {
      waiting_.push_front(task);
    } else {
      ++failed_;
    }
  }

  void Show() {
    const std::size_t done = finished_ + failed_;
    std::string text = std::to_string(done) + "/" + std::to_string(missions_) + " missions, ";
    if (failed_ > 0) text += std::to_string(failed_) + " failed, ";
    text += std::to_string(static_cast<int>(stopwatch_.seconds())) + " s";
    bar_.Show(static_cast<double>(done) / static_cast<double>(missions_), text);
  }

  const CampaignFolder& folder_;
  std::size_t missions_, finished_ = 0, failed_ = 0;
  int attempts_;
  std::deque<Task> waiting_;
  std::vector<Flight> flying_;
  Stopwatch stopwatch_;
  ProgressBar bar_;
};

}  // namespace

void FlyLocally(const CampaignFolder& folder, const std::vector<MissionId>& missions, int jobs,
                int attempts) {
  LocalEngine(folder, missions, attempts).Fly(jobs);
}

}  // namespace vog
