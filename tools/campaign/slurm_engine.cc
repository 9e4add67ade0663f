#include "tools/campaign/slurm_engine.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/log.h"
#include "lib/bus/process.h"
#include "lib/bus/stopwatch.h"
#include "tools/campaign/local_engine.h"
#include "tools/campaign/slurm.h"
#include "tools/campaign/summary.h"
#include "tools/launch/child_process.h"
#include "tools/mission/progress_bar.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

// Rounds in a row without a result that end a campaign.
constexpr int kFruitlessRounds = 2;
// Slurm begins a task anew when its node is lost; a task that takes its nodes along is given up.
constexpr int kMostRestarts = 3;
// How often the folder is looked at, and the queue: more seldom the longer a campaign takes, unless
// all results are there.
constexpr double kLookAtFolder_s = 1, kLookAtQueue_s = 1, kMostSeldom_s = 15, kShareOfTime = 0.1;

/// The same wherever the campaign's folder is looked at from, and no other campaign's.
std::string JobName(const fs::path& folder) {
  return "vog-" + ToHex(Crc32(fs::canonical(folder).string()));
}

/// The rounds of a campaign: who of them is next, and its jobs. The command that waits and the job
/// after an array both use it, never at once: that job is in the queue while it works, and the
/// command leaves a campaign alone that has jobs there.
class Rounds {
 public:
  Rounds(const CampaignFolder& folder, const Campaign& campaign, SlurmOrder order)
      : folder_(folder),
        slurm_folder_(fs::canonical(folder.path())),
        campaign_(campaign),
        order_(std::move(order)),
        slurm_(JobName(folder.path()), order_.arguments) {}

  const Slurm& slurm() const { return slurm_; }
  const Campaign& campaign() const { return campaign_; }

  /// Submits the first round of a command, in which everything has its chances anew.
  void Begin() {
    const std::vector<MissionId> missing = MissingOf(folder_, campaign_.Missions());
    for (const MissionId& mission : missing) fs::remove(folder_.OutputOf(mission));
    Submit({slurm_folder_.ReadRound().number + 1, FinishedBut(missing), 0, ""}, missing);
  }

  /// Submits another round after the last, which has ended. False when there is to be none.
  bool GoOn() {
    const SlurmRound last = slurm_folder_.ReadRound();
    const std::vector<MissionId> missing = MissingOf(folder_, campaign_.Missions());
    if (missing.empty()) return false;
    const std::size_t finished = FinishedBut(missing);
    SlurmRound next{last.number + 1, finished, last.fruitless, ""};
    if (!last.job.empty()) {  // Else who submitted it broke off.
      if (slurm_.IsCancelled(last.job))
        throw SystemError("job " + last.job +
                          " was cancelled; the same command flies what is missing");
      if (finished == last.finished) RejectUnbegun(last, missing);
      next.fruitless = finished > last.finished ? 0 : last.fruitless + 1;
    }
    if (next.fruitless >= kFruitlessRounds) return false;
    Submit(next, missing);
    return true;
  }

 private:
  std::size_t FinishedBut(const std::vector<MissionId>& missing) const {
    return campaign_.Missions().size() - missing.size();
  }

  void Submit(SlurmRound round, const std::vector<MissionId>& missing) const {
    slurm_folder_.Prepare();
    const int per_task =
        order_.missions_per_task > 0 ? order_.missions_per_task : MissionsPerTask(missing.size());
    const std::vector<std::vector<MissionId>> tasks = DealOut(missing, per_task);
    slurm_folder_.WriteTasks(round.number, tasks);
    slurm_folder_.Write(round);
    SlurmJob array{CommandOf("--slurm-task", round), slurm_folder_.LogOf(round.number),
                   static_cast<int>(tasks.size()), order_.tasks_at_a_time, ""};
    round.job = slurm_.Submit(array);
    slurm_folder_.Write(round);
    try {
      slurm_.Submit({CommandOf("--slurm-close", round), array.log, 0, 0, round.job});
    } catch (const SystemError& error) {
      LogLine("the campaign goes on only while this command waits: " + std::string(error.what()));
    }
  }

  std::string CommandOf(const std::string& option, const SlurmRound& round) const {
    return "exec " + ShellQuoted(slurm_folder_.program().string()) + " campaign --out " +
           ShellQuoted(fs::canonical(folder_.path()).string()) + " " + option + " " +
           std::to_string(round.number);
  }

  /// @throws SystemError when the round's tasks have ended before they flew anything.
  void RejectUnbegun(const SlurmRound& round, const std::vector<MissionId>& missing) const {
    const auto has_begun = [&](const MissionId& mission) {
      return fs::exists(folder_.OutputOf(mission));
    };
    if (std::any_of(missing.begin(), missing.end(), has_begun)) return;
    const fs::path log = slurm_folder_.LogOf(round.number);
    if (!fs::exists(log))
      throw SystemError("job " + round.job + " left nothing in " + folder_.path().string() +
                        ": is that on a file system that all nodes share?");
    throw SystemError("job " + round.job + " flew no mission: " + LastLine(log) + "; see " +
                      log.string());
  }

  const CampaignFolder& folder_;
  SlurmFolder slurm_folder_;
  const Campaign& campaign_;
  SlurmOrder order_;
  Slurm slurm_;
};

/// The command that waits for a campaign's jobs.
class SlurmEngine {
 public:
  SlurmEngine(const CampaignFolder& folder, const Campaign& campaign, const SlurmOrder& order)
      : folder_(folder), rounds_(folder, campaign, order), missing_(campaign.Missions()) {}

  void Fly() {
    const std::atomic<bool>& stop = StopSignal();
    if (rounds_.slurm().Queue().jobs == 0) rounds_.Begin();
    while (true) {
      if (stop)
        throw SystemError("the jobs go on; the same command comes back to them, scancel --name=" +
                          rounds_.slurm().job_name() + " ends them");
      if (IsTimeFor(folder_looked_at_, kLookAtFolder_s)) missing_ = MissingOf(folder_, missing_);
      if (IsTimeFor(queue_looked_at_, QueueInterval_s()) && !LookAtQueue()) return;
      Show();
      WaitBriefly();
    }
  }

 private:
  bool IsTimeFor(double& last, double interval_s) {
    if (stopwatch_.seconds() < last + interval_s) return false;
    last = stopwatch_.seconds();
    return true;
  }

  double QueueInterval_s() const {
    if (missing_.empty()) return kLookAtQueue_s;
    return std::clamp(kShareOfTime * stopwatch_.seconds(), kLookAtQueue_s, kMostSeldom_s);
  }

  /// False when there is nothing to wait for any more.
  bool LookAtQueue() {
    try {
      queue_ = rounds_.slurm().Queue();
      missing_ = MissingOf(folder_, missing_);
      if (missing_.empty() && queue_->running == 0 && queue_->waiting_tasks == 0) {
        rounds_.slurm().CancelAll();  // The closing job has nothing to do.
        return false;
      }
    } catch (const SystemError&) {  // Its controller may be restarted: jobs do not mind.
      queue_.reset();
      return true;
    }
    return queue_->jobs > 0 || rounds_.GoOn();
  }

  void Show() {
    const std::size_t missions = rounds_.campaign().Missions().size();
    const std::size_t done = missions - missing_.size();
    std::string text = std::to_string(done) + "/" + std::to_string(missions) + " missions, ";
    if (!queue_) {
      text += "Slurm does not answer, ";
    } else {
      text += std::to_string(queue_->running) + " running, ";
      if (queue_->waiting_tasks > 0) text += std::to_string(queue_->waiting_tasks) + " waiting, ";
      if (queue_->running == 0 && queue_->waiting_tasks > 0)
        text += "for " + queue_->why_waiting + ", ";
    }
    text += std::to_string(static_cast<int>(stopwatch_.seconds())) + " s";
    bar_.Show(static_cast<double>(done) / static_cast<double>(missions), text);
  }

  const CampaignFolder& folder_;
  Rounds rounds_;
  std::vector<MissionId> missing_;
  std::optional<SlurmQueue> queue_ = SlurmQueue{};
  double folder_looked_at_ = -kLookAtFolder_s, queue_looked_at_ = 0;
  Stopwatch stopwatch_;
  ProgressBar bar_;
};

/// A number that Slurm tells its jobs.
std::optional<int> NumberFromSlurm(const char* variable) {
  const char* text = std::getenv(variable);
  const std::string_view view = text == nullptr ? "" : text;
  int number = 0;
  const auto [end, fault] = std::from_chars(view.data(), view.data() + view.size(), number);
  if (fault != std::errc() || end != view.data() + view.size()) return std::nullopt;
  return number;
}

}  // namespace

void FlyBySlurm(const CampaignFolder& folder, const Campaign& campaign, const SlurmOrder& order) {
  if (MissingOf(folder, campaign.Missions()).empty()) return;
  const SlurmFolder slurm_folder(folder.path());
  slurm_folder.Prepare();
  slurm_folder.Write(order);
  SlurmEngine(folder, campaign, order).Fly();
}

void FlySlurmTask(const fs::path& path, int round) {
  const std::optional<int> task = NumberFromSlurm("SLURM_ARRAY_TASK_ID");
  if (!task) throw UsageError("--slurm-task: only a task of a Slurm array has such work");
  const CampaignFolder folder = CampaignFolder::Join(path);
  const int restarts = NumberFromSlurm("SLURM_RESTART_COUNT").value_or(0);
  if (restarts > kMostRestarts)
    throw SystemError("task " + std::to_string(*task) + ": began " + std::to_string(restarts) +
                      " times and did not end");
  const std::vector<MissionId> missions =
      MissingOf(folder, SlurmFolder(path).ReadTask(round, *task));
  FlyLocally(folder, missions, std::max(1, NumberFromSlurm("SLURM_CPUS_ON_NODE").value_or(1)),
             /*attempts=*/1);
  if (const std::size_t failed = MissingOf(folder, missions).size(); failed > 0)
    throw SystemError("task " + std::to_string(*task) + ": " + std::to_string(failed) + " of " +
                      std::to_string(missions.size()) + " missions failed");
}

void CloseSlurmRound(const fs::path& path, int round) {
  const SlurmFolder slurm_folder(path);
  if (slurm_folder.ReadRound().number != round) return;  // A later one has begun.
  const CampaignFolder folder = CampaignFolder::Join(path);
  const SlurmOrder order = slurm_folder.ReadOrder();
  Campaign campaign = WithCases(folder.ReadCampaign(), order.cases);
  campaign.seeds = order.seeds;
  try {
    if (Rounds(folder, campaign, order).GoOn()) return;
  } catch (const std::exception&) {
    WriteTables(folder, campaign);  // Of what is there, as nothing else will come by itself.
    throw;
  }
  WriteTables(folder, campaign);
}

}  // namespace vog
