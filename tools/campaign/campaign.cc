#include "tools/campaign/campaign.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "tools/mission/mission.h"
#include "tools/mission/simulation_check.h"

namespace vog {
namespace {

constexpr std::array<std::string_view, 2> kTables = {"campaign", "case"};

/// Table [campaign].
struct CampaignOptions {
  std::string name = "campaign";
  std::string seeds = "1..10";
  std::vector<std::string> keep;

  void Visit(OptionsVisitor& v) {
    v("name", name, "of the campaign, for the table");
    v("seeds", seeds, "A..B: each case is flown with seeds A to B");
    v("keep", keep, KeepNames(), "what is kept of each mission beside its numbers");
  }
};

/// One of the tables [[case]].
struct CaseOptions {
  std::string name, mission, scene;
  std::vector<std::string> set;

  void Visit(OptionsVisitor& v) {
    v("name", name, "of the case; spaces become - in its folder's name");
    v("mission", mission, "mission file, relative to this one");
    v("scene", scene, "a mesh to explore instead, relative to this file");
    v("set", set, {}, "table.key=value, on top of the mission file");
  }
};

bool IsSeed(std::string_view text, std::int64_t& seed) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), seed);
  return fault == std::errc() && end == text.data() + text.size() && seed >= 0;
}

/// The name as a folder's. @throws UsageError for a name that cannot be one.
std::string FolderOf(const std::string& name, const std::string& where) {
  std::string folder = name;
  std::replace(folder.begin(), folder.end(), ' ', '-');
  constexpr std::string_view kAllowed =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  if (folder.empty() || folder.find_first_not_of(kAllowed) != std::string::npos)
    throw UsageError(where + "a case's name must be of letters, digits, spaces, - and _, not '" +
                     name + "'");
  return folder;
}

/// The first of `keys` that is set.
std::string WhereIs(const Config& config, std::initializer_list<std::string> keys) {
  for (const std::string& key : keys) {
    const std::string where = config.WhereIs(key);
    if (!where.empty()) return where;
  }
  return "";
}

Config MissionOf(const CaseOptions& options, const std::string& directory) {
  for (const std::string& setting : options.set)
    if (setting.starts_with("mission.seed"))
      throw UsageError(setting + ": the seeds are those of the campaign");
  const std::filesystem::path here = directory;
  MissionOverrides overrides;
  if (!options.scene.empty()) overrides.scene = (here / options.scene).string();
  overrides.settings = options.set;
  Config mission = ReadMission((here / options.mission).lexically_normal().string(), overrides);
  CheckedSimSettings(mission);
  return mission;
}

CampaignCase ReadCase(const Config& config, const std::string& table) {
  const auto options = config.Read<CaseOptions>(table);
  const std::string where = WhereIs(config, {table + ".name", table});
  CampaignCase read{options.name, FolderOf(options.name, where), {}};
  if (options.mission.empty()) throw UsageError(where + "a case needs mission = \"FILE\"");
  try {
    read.mission = MissionOf(options, config.directory());
  } catch (const UsageError& error) {
    throw UsageError(where + "case '" + options.name + "': " + error.what());
  }
  return read;
}

bool HasOneInName(const CampaignCase& one, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return one.name.find(word) != std::string::npos;
  });
}

std::string NamesOf(const std::vector<CampaignCase>& cases) {
  std::string names;
  for (const CampaignCase& one : cases) names += (names.empty() ? "'" : ", '") + one.name + "'";
  return names;
}

}  // namespace

const std::vector<std::string>& KeepNames() {
  static const std::vector<std::string> names = {"map", "log", "report", "clouds", "trajectories"};
  return names;
}

SeedRange ParseSeeds(const std::string& text, const std::string& where) {
  const std::size_t dots = text.find("..");
  SeedRange seeds;
  const std::string first = text.substr(0, dots);
  const std::string last = dots == std::string::npos ? first : text.substr(dots + 2);
  if (!IsSeed(first, seeds.first) || !IsSeed(last, seeds.last) || seeds.last < seeds.first)
    throw UsageError(where + "seeds must be A..B with 0 <= A <= B, not '" + text + "'");
  return seeds;
}

MissionId ParseMission(const std::string& text) {
  const std::size_t slash = text.find('/');
  std::int64_t seed = 0;
  if (slash == std::string::npos || !IsSeed(std::string_view(text).substr(slash + 1), seed))
    throw UsageError(text + ": no mission; write CASE/SEED");
  return {text.substr(0, slash), seed};
}

std::vector<MissionId> Campaign::Missions() const {
  std::vector<MissionId> missions;
  for (const CampaignCase& one : cases)
    for (std::int64_t seed = seeds.first; seed <= seeds.last; ++seed)
      missions.push_back({one.folder, seed});
  return missions;
}

Campaign LoadCampaign(const std::string& file, const std::optional<SeedRange>& seeds) {
  const Config config = Config::Load(file);
  config.RejectUnknownTables(kTables);
  const auto options = config.Read<CampaignOptions>("campaign");
  Campaign campaign{options.name, {}, options.keep, {}};
  const SeedRange own = ParseSeeds(options.seeds, config.WhereIs("campaign.seeds"));
  campaign.seeds = seeds.value_or(own);
  const int cases = config.CountOf("case");
  if (cases == 0) throw UsageError(file + ": no case to fly: write [[case]] with name and mission");
  for (int i = 0; i < cases; ++i) {
    const std::string table = "case[" + std::to_string(i) + "]";
    CampaignCase next = ReadCase(config, table);
    const auto same = [&](const CampaignCase& one) { return one.folder == next.folder; };
    if (std::any_of(campaign.cases.begin(), campaign.cases.end(), same))
      throw UsageError(config.WhereIs(table + ".name") + "there is a case '" + next.name +
                       "' already");
    campaign.cases.push_back(std::move(next));
  }
  return campaign;
}

void CheckCases(const Campaign& campaign, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (std::none_of(campaign.cases.begin(), campaign.cases.end(),
                     [&](const CampaignCase& one) { return HasOneInName(one, {word}); }))
      throw UsageError("--cases: no case has '" + word + "' in its name; there are " +
                       NamesOf(campaign.cases));
}

Campaign WithCases(Campaign campaign, const std::vector<std::string>& words) {
  CheckCases(campaign, words);
  if (words.empty()) return campaign;
  std::erase_if(campaign.cases, [&](const CampaignCase& one) { return !HasOneInName(one, words); });
  return campaign;
}

}  // namespace vog
