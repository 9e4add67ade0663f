#include "tools/campaign/campaign_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <sstream>

#include "lib/base/files.h"
#include "lib/base/parallel.h"
#include "sim/scene/scene_options.h"
#include "tools/mission/evaluate.h"
#include "tools/mission/judge.h"
#include "tools/mission/mission.h"

namespace vog {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kMissions = "missions.json";
constexpr const char* kLock = "campaign.lock";

// --- what a folder holds ---

/// Version and check sum of the running program: results of two programs do not mix.
std::string ProgramText() {
  return "vog " VOG_VERSION " " + ToHex(Crc32(ReadFile("/proc/self/exe")));
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string TextOf(const Json& lines) {
  std::string text;
  for (const Json& line : lines) text += line.get<std::string>() + "\n";
  return text;
}

/// Everything that a mission's result depends on, beside its seed.
Json MissionsJson(const Campaign& campaign) {
  Json json = {{"program", ProgramText()}, {"name", campaign.name}};
  for (const std::string& name : KeepNames())
    json["keep"][name] =
        std::find(campaign.keep.begin(), campaign.keep.end(), name) != campaign.keep.end();
  for (const CampaignCase& one : campaign.cases) {
    Json& entry = json["cases"][one.folder];
    entry["name"] = one.name;
    const std::string mesh = one.mission.Read<SceneOptions>("scene").mesh;
    if (!mesh.empty()) entry["mesh_crc32"] = ToHex(Crc32(ReadFile(mesh)));
    entry["settings"] = LinesOf(one.mission.ToToml());
  }
  return json;
}

/// Without what stands around a line of JSON.
std::string Trimmed(const std::string& line) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  return line.substr(begin, line.find_last_not_of(',') + 1 - begin);
}

/// The first difference between two texts, for a message.
std::string FirstDifference(const std::string& there, const std::string& here) {
  const std::vector<std::string> a = LinesOf(there), b = LinesOf(here);
  std::size_t i = 0;
  while (i < a.size() && i < b.size() && a[i] == b[i]) ++i;
  const auto line = [&](const auto& lines) {
    return i < lines.size() ? Trimmed(lines[i]) : "nothing";
  };
  return line(a) + " there, " + line(b) + " here";
}

void RejectForeign(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != kLock && name != std::string(kMissions) + ".tmp")
      throw UsageError(folder.string() + ": holds " + name +
                       " and no campaign; choose another folder");
  }
}

// --- places ---

fs::path PlaceOf(const fs::path& folder, const MissionId& mission, const char* ending) {
  return folder / mission.case_folder / (std::to_string(mission.seed) + ending);
}

bool HasResult(const fs::path& result) { return fs::is_regular_file(result / "metrics.json"); }

// --- a task ---

Json ReadMissions(const fs::path& folder) {
  const fs::path file = folder / kMissions;
  if (!fs::is_regular_file(file)) throw UsageError(folder.string() + ": holds no campaign");
  Json json = Json::parse(ReadFile(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) throw UsageError(file.string() + ": damaged: not a JSON object");
  if (json["program"] != ProgramText())
    throw UsageError(folder.string() + ": the campaign is of another program");
  return json;
}

MissionId ParseMission(const std::string& text, const Json& missions) {
  const std::size_t slash = text.find('/');
  const std::string name = text.substr(0, slash);
  if (slash == std::string::npos || !missions["cases"].contains(name))
    throw UsageError(text + ": no mission of the campaign; write CASE/SEED");
  const SeedRange seeds = ParseSeeds(text.substr(slash + 1), text + ": ");
  return {name, seeds.first};
}

/// The files that keeping something means.
const std::map<std::string, std::vector<std::string>>& FilesToKeep() {
  static const std::map<std::string, std::vector<std::string>> files = {
      {"map", {"map"}},
      {"log", {"lcm.log"}},
      {"report", {"report.html"}},
      {"clouds",
       {"scene.ply", "reconstruction_truth.ply", "reconstruction_vog.ply",
        "reconstruction_vog_no_lc.ply", "reconstruction_standard.ply"}},
      {"trajectories", {"truth.tum", "odometry.tum", "estimate.tum"}}};
  return files;
}

/// Removes what is not kept.
void Prune(const fs::path& result, const Json& keep) {
  std::vector<std::string> kept = {"metrics.json", "timing.json", "timeseries.json"};
  for (const auto& [name, files] : FilesToKeep())
    if (keep[name].get<bool>()) kept.insert(kept.end(), files.begin(), files.end());
  std::vector<fs::path> bulk;
  for (const auto& entry : fs::directory_iterator(result))
    if (std::find(kept.begin(), kept.end(), entry.path().filename()) == kept.end())
      bulk.push_back(entry.path());
  for (const fs::path& path : bulk) fs::remove_all(path);
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder)
    : fd_(::open((folder / kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (fd_ < 0)
    throw SystemError((folder / kLock).string() + ": cannot create: " + std::strerror(errno));
  if (::flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
  ::close(fd_);
  throw SystemError(folder.string() + ": another vog campaign works there");
}

FolderLock::~FolderLock() { ::close(fd_); }

CampaignFolder::CampaignFolder(fs::path folder, const Campaign& campaign)
    : folder_(std::move(folder)) {
  const std::string missions = MissionsJson(campaign).dump(1) + "\n";
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw SystemError(folder_.string() + ": cannot create: " + error.message());
  const fs::path file = folder_ / kMissions;
  if (!fs::exists(file)) RejectForeign(folder_);
  lock_.emplace(folder_);
  if (!fs::exists(file)) {
    WriteFileAtomically(file, missions);
  } else if (!FileHolds(file, missions)) {
    throw UsageError(folder_.string() + ": was begun with other settings or another program: " +
                     FirstDifference(ReadFile(file), missions) + "; choose another folder");
  }
  for (const CampaignCase& one : campaign.cases) fs::create_directories(folder_ / one.folder);
}

fs::path CampaignFolder::ResultOf(const MissionId& mission) const {
  return PlaceOf(folder_, mission, "");
}

fs::path CampaignFolder::OutputOf(const MissionId& mission) const {
  return PlaceOf(folder_, mission, ".txt");
}

bool CampaignFolder::IsFinished(const MissionId& mission) const {
  return HasResult(ResultOf(mission));
}

void FlyTask(const fs::path& folder, const std::string& text) {
  const Json missions = ReadMissions(folder);
  const MissionId mission = ParseMission(text, missions);
  const fs::path result = PlaceOf(folder, mission, ""), part = PlaceOf(folder, mission, ".part");
  if (HasResult(result)) return;
  SetParallelThreads(1);  // Others fly beside this one.
  const Json& keep = missions["keep"];
  Config config = Config::Parse(TextOf(missions["cases"][mission.case_folder]["settings"]),
                                (folder / kMissions).string());
  config.Set("mission.seed=" + std::to_string(mission.seed));
  CheckConfig(config);
  NumberRun(config);
  fs::remove_all(part);
  FlyMission(config, part);
  if (keep["report"].get<bool>()) {
    JudgeRun(part);
  } else {
    EvaluateRun(part);
  }
  Prune(part, keep);
  fs::remove_all(result);  // There when somebody took metrics.json out of it.
  fs::rename(part, result);
}

}  // namespace vog
