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
#include "tools/campaign/slurm.h"
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

bool HasResult(const fs::path& result) {
  std::error_code ignored;
  return fs::is_regular_file(result / "metrics.json", ignored);
}

/// Where a mission is flown. Two Slurm jobs may fly one mission, when a node that was given up
/// still runs: each has a place of its own.
fs::path PartOf(const fs::path& folder, const MissionId& mission) {
  const std::string job = SlurmAttempt();
  return PlaceOf(folder, mission, job.empty() ? ".part" : (".part-" + job).c_str());
}

// --- a task ---

/// What MissionsJson() has written.
Campaign ToCampaign(const Json& json, const std::string& file) {
  Campaign campaign{json.at("name"), {}, {}, {}};
  for (const auto& [name, is_kept] : json.at("keep").items())
    if (is_kept.get<bool>()) campaign.keep.push_back(name);
  for (const auto& [name, entry] : json.at("cases").items())
    campaign.cases.push_back(
        {entry.at("name"), name, Config::Parse(TextOf(entry.at("settings")), file)});
  return campaign;
}

CampaignCase& CaseOf(Campaign& campaign, const MissionId& mission) {
  const auto found =
      std::find_if(campaign.cases.begin(), campaign.cases.end(),
                   [&](const CampaignCase& one) { return one.folder == mission.case_folder; });
  if (found == campaign.cases.end())
    throw UsageError(mission.text() + ": the campaign has no such case");
  return *found;
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
void Prune(const fs::path& result, const std::vector<std::string>& keep) {
  std::vector<std::string> kept = {"metrics.json", "timing.json", "timeseries.json"};
  for (const std::string& name : keep) {
    const std::vector<std::string>& files = FilesToKeep().at(name);
    kept.insert(kept.end(), files.begin(), files.end());
  }
  std::vector<fs::path> bulk;
  for (const auto& entry : fs::directory_iterator(result))
    if (std::find(kept.begin(), kept.end(), entry.path().filename()) == kept.end())
      bulk.push_back(entry.path());
  for (const fs::path& path : bulk) fs::remove_all(path);
}

void Fly(Config& config, const std::vector<std::string>& keep, const fs::path& part) {
  CheckConfig(config);
  NumberRun(config);
  fs::remove_all(part);
  FlyMission(config, part);
  if (std::find(keep.begin(), keep.end(), "report") != keep.end()) {
    JudgeRun(part);
  } else {
    EvaluateRun(part);
  }
  Prune(part, keep);
}

/// Makes `part` the result by one rename, unless another process was first.
void MakeResult(const fs::path& part, const fs::path& result) {
  std::error_code error;
  fs::rename(part, result, error);
  if (!error || HasResult(result)) return;
  fs::remove_all(result);  // There when somebody took metrics.json out of it.
  fs::rename(part, result);
}

/// Removes what those have left that flew the mission in vain.
void RemoveParts(const fs::path& folder, const MissionId& mission) {
  const fs::path part = PlaceOf(folder, mission, ".part");
  std::vector<fs::path> parts;
  for (const auto& entry : fs::directory_iterator(part.parent_path())) {
    const std::string name = entry.path().filename().string(), own = part.filename().string();
    if (name == own || name.starts_with(own + "-")) parts.push_back(entry.path());
  }
  std::error_code ignored;  // One that still flies may write there.
  for (const fs::path& path : parts) fs::remove_all(path, ignored);
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder)
    : fd_(::open((folder / kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (fd_ < 0)
    throw SystemError((folder / kLock).string() + ": cannot create: " + std::strerror(errno));
  if (::flock(fd_, LOCK_EX | LOCK_NB) == 0 || errno == ENOSYS || errno == EOPNOTSUPP) return;
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

CampaignFolder CampaignFolder::Join(const fs::path& folder) {
  if (!fs::is_regular_file(folder / kMissions))
    throw UsageError(folder.string() + ": holds no campaign");
  return CampaignFolder(folder);
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

Campaign CampaignFolder::ReadCampaign() const {
  const std::string file = (folder_ / kMissions).string();
  try {
    const Json json = Json::parse(ReadFile(file));
    if (json.at("program") != ProgramText())
      throw UsageError(folder_.string() + ": the campaign is of another program");
    return ToCampaign(json, file);
  } catch (const Json::exception& error) {
    throw UsageError(file + ": damaged: " + error.what());
  }
}

std::vector<MissionId> MissingOf(const CampaignFolder& folder, std::vector<MissionId> missions) {
  std::erase_if(missions, [&](const MissionId& mission) { return folder.IsFinished(mission); });
  return missions;
}

void FlyTask(const fs::path& path, const std::string& text) {
  const CampaignFolder folder = CampaignFolder::Join(path);
  Campaign campaign = folder.ReadCampaign();
  const MissionId mission = ParseMission(text);
  Config& config = CaseOf(campaign, mission).mission;
  if (folder.IsFinished(mission)) return;
  SetParallelThreads(1);  // Others fly beside this one.
  config.Set("mission.seed=" + std::to_string(mission.seed));
  const fs::path part = PartOf(path, mission);
  try {
    Fly(config, campaign.keep, part);
    MakeResult(part, folder.ResultOf(mission));
  } catch (const std::exception&) {
    // Who was first has removed what this one wrote.
    if (!folder.IsFinished(mission)) throw;
  }
  RemoveParts(path, mission);
}

}  // namespace vog
