#include "tools/campaign/slurm_round.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::size_t CeilOfRatio(std::size_t a, std::size_t b) { return (a + b - 1) / b; }

/// What `read` makes of a JSON file. @throws UsageError when it is damaged.
template <class Read>
auto ReadJson(const fs::path& file, Read read) {
  try {
    return read(Json::parse(ReadFile(file)));
  } catch (const Json::exception& error) {
    throw UsageError(file.string() + ": damaged; remove it: " + error.what());
  }
}

}  // namespace

fs::path SlurmFolder::LogOf(int round) const {
  return path_ / ("round-" + std::to_string(round) + ".log");
}

fs::path SlurmFolder::TasksOf(int round) const {
  return path_ / ("tasks-" + std::to_string(round) + ".txt");
}

void SlurmFolder::Prepare() const {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) throw SystemError(path_.string() + ": cannot create: " + error.message());
  if (fs::exists(program())) return;
  const fs::path beside = program().string() + ".tmp";
  fs::copy_file("/proc/self/exe", beside, fs::copy_options::overwrite_existing, error);
  if (!error) fs::rename(beside, program(), error);
  if (error) throw SystemError(program().string() + ": cannot write: " + error.message());
}

void SlurmFolder::Write(const SlurmOrder& order) const {
  const Json json = {{"seeds", {{"first", order.seeds.first}, {"last", order.seeds.last}}},
                     {"cases", order.cases},
                     {"tasks_at_a_time", order.tasks_at_a_time},
                     {"missions_per_task", order.missions_per_task},
                     {"sbatch", order.arguments}};
  WriteFileAtomically(path_ / "order.json", json.dump(1) + "\n");
}

void SlurmFolder::Write(const SlurmRound& round) const {
  const Json json = {{"round", round.number},
                     {"finished", round.finished},
                     {"fruitless", round.fruitless},
                     {"job", round.job}};
  WriteFileAtomically(path_ / "round.json", json.dump(1) + "\n");
}

void SlurmFolder::WriteTasks(int round, const std::vector<std::vector<MissionId>>& tasks) const {
  std::string text;
  for (const auto& task : tasks) {
    for (const MissionId& mission : task) text += mission.text() + " ";
    text.back() = '\n';
  }
  WriteFileAtomically(TasksOf(round), text);
}

SlurmOrder SlurmFolder::ReadOrder() const {
  return ReadJson(path_ / "order.json", [](const Json& json) {
    return SlurmOrder{{json.at("seeds").at("first"), json.at("seeds").at("last")},
                      json.at("cases"),
                      json.at("tasks_at_a_time"),
                      json.at("missions_per_task"),
                      json.at("sbatch")};
  });
}

SlurmRound SlurmFolder::ReadRound() const {
  const fs::path file = path_ / "round.json";
  if (!fs::exists(file)) return {};
  return ReadJson(file, [](const Json& json) {
    return SlurmRound{json.at("round"), json.at("finished"), json.at("fruitless"), json.at("job")};
  });
}

std::vector<MissionId> SlurmFolder::ReadTask(int round, int task) const {
  std::istringstream lines(ReadFile(TasksOf(round)));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (number != task) continue;
    std::vector<MissionId> missions;
    std::istringstream words(line);
    for (std::string word; words >> word;) missions.push_back(ParseMission(word));
    return missions;
  }
  throw UsageError(TasksOf(round).string() + ": has no task " + std::to_string(task));
}

int MissionsPerTask(std::size_t missions) {
  constexpr std::size_t kTasks = 250, kMostMissions = 100, kMostTasks = 1000;
  return static_cast<int>(
      std::max({std::size_t{1}, std::min(CeilOfRatio(missions, kTasks), kMostMissions),
                CeilOfRatio(missions, kMostTasks)}));
}

std::vector<std::vector<MissionId>> DealOut(const std::vector<MissionId>& missions, int per_task) {
  std::vector<std::vector<MissionId>> tasks(
      CeilOfRatio(missions.size(), static_cast<std::size_t>(per_task)));
  for (std::size_t i = 0; i < missions.size(); ++i) tasks[i % tasks.size()].push_back(missions[i]);
  return tasks;
}

}  // namespace vog
