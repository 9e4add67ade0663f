#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/campaign/campaign.h"

namespace vog {

/// How a campaign is to be flown by Slurm.
struct SlurmOrder {
  SeedRange seeds;
  std::vector<std::string> cases;      ///< For WithCases().
  int tasks_at_a_time = 0;             ///< 0: as many as the cluster lets.
  int missions_per_task = 0;           ///< 0: MissionsPerTask().
  std::vector<std::string> arguments;  ///< For sbatch.
};

/// One array of tasks. Missions without a result when it has ended fly in another round.
struct SlurmRound {
  int number = 0;
  std::size_t finished = 0;  ///< Missions that had a result when it was submitted.
  int fruitless = 0;         ///< Rounds in a row before it that brought no result.
  std::string job;           ///< The array's number; empty when it was not submitted.
};

/// What a campaign keeps for Slurm, DIR/slurm:
///
///   order.json       what the last command asked for
///   round.json       how far the campaign is
///   tasks-ROUND.txt  a line a task: its missions
///   round-ROUND.log  what the jobs of a round said
///   vog              the program as it was, whatever is built meanwhile
class SlurmFolder {
 public:
  explicit SlurmFolder(const std::filesystem::path& campaign) : path_(campaign / "slurm") {}

  std::filesystem::path program() const { return path_ / "vog"; }
  std::filesystem::path LogOf(int round) const;

  /// Makes the folder, with the running program in it.
  void Prepare() const;
  void Write(const SlurmOrder& order) const;
  void Write(const SlurmRound& round) const;
  void WriteTasks(int round, const std::vector<std::vector<MissionId>>& tasks) const;
  /// @throws SystemError when it is missing, UsageError when it is damaged.
  SlurmOrder ReadOrder() const;
  /// The zeroth, when there was none. @throws UsageError when it is damaged.
  SlurmRound ReadRound() const;
  /// @throws SystemError when the file is missing, UsageError when there is no such task.
  std::vector<MissionId> ReadTask(int round, int task) const;

 private:
  std::filesystem::path TasksOf(int round) const;

  std::filesystem::path path_;
};

/// Missions for a task: 1 for a campaign of up to 250, growing with it to 100, so that a scheduler
/// that starts a task a second keeps up; more where an array would have more than 1000 tasks
/// (MaxArraySize).
int MissionsPerTask(std::size_t missions);

/// Deals the missions out to tasks of at most `per_task`, turn by turn: the missions of one case
/// take about the same time.
std::vector<std::vector<MissionId>> DealOut(const std::vector<MissionId>& missions, int per_task);

}  // namespace vog
