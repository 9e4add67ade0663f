#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/campaign.h"

namespace vog {

/// Holds a folder for this process alone, until it ends, however that happens.
class FolderLock {
 public:
  /// @throws SystemError when another process holds it. A file system without locks holds nobody
  /// off.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

/// The folder of a campaign:
///
///   missions.json     what is flown there: program, cases and their settings. Written once
///   CASE/SEED/        a mission's result, there whole or not at all
///   CASE/SEED.part/   a mission that is being flown, or broke off; in a Slurm job SEED.part-JOB
///   CASE/SEED.txt     what such a mission said last
///
/// Missions are flown by processes of their own (FlyTask()), here or on other machines.
class CampaignFolder {
 public:
  /// The folder of a campaign that another process has begun, for one that works for it: it is not
  /// locked. @throws UsageError when there is none.
  static CampaignFolder Join(const std::filesystem::path& folder);

  /// Takes the folder for `campaign`, for this process alone: makes it, or goes on with it. Seeds
  /// may differ. @throws UsageError when the folder holds anything else, or was begun with other
  /// settings or another program; SystemError when another process works there.
  CampaignFolder(std::filesystem::path folder, const Campaign& campaign);

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path ResultOf(const MissionId& mission) const;
  std::filesystem::path OutputOf(const MissionId& mission) const;
  bool IsFinished(const MissionId& mission) const;

  /// The campaign as it was begun, without its seeds. @throws UsageError when it is damaged or
  /// another program's.
  Campaign ReadCampaign() const;

 private:
  explicit CampaignFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
  std::optional<FolderLock> lock_;
};

/// Those of `missions` that have no result.
std::vector<MissionId> MissingOf(const CampaignFolder& folder, std::vector<MissionId> missions);

/// Flies the mission "CASE/SEED" of the campaign in `folder` and puts its result in place, unless
/// that is there. Several may fly one mission: the first result stays. @throws UsageError when
/// there is no such mission or the campaign is another program's, SystemError.
void FlyTask(const std::filesystem::path& folder, const std::string& mission);

}  // namespace vog
