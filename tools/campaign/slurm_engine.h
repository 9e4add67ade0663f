#pragma once

#include <filesystem>

#include "tools/campaign/campaign_folder.h"
#include "tools/campaign/slurm_round.h"

namespace vog {

/// Flies what is missing of a campaign as Slurm jobs, in rounds (SlurmRound): an array of tasks,
/// each of which flies several missions (FlySlurmTask()), and a job that waits for the array's end
/// (CloseSlurmRound()). Jobs of the campaign that are queued or run already are waited for instead.
/// Shows how far it is and returns when all missions have a result, or two rounds in a row brought
/// none. @throws UsageError where there is no Slurm; SystemError when Slurm refuses, when the jobs
/// were cancelled or began no mission, and after SIGINT or SIGTERM: the jobs go on.
void FlyBySlurm(const CampaignFolder& folder, const Campaign& campaign, const SlurmOrder& order);

/// What a task of a round's array does: flies its missions that have no result, one after another
/// on each processor that the job has. @throws UsageError outside of a job, SystemError when
/// missions have failed.
void FlySlurmTask(const std::filesystem::path& folder, int round);

/// What the job after an array does: submits the next round, if there is to be one, or writes the
/// campaign's tables.
void CloseSlurmRound(const std::filesystem::path& folder, int round);

}  // namespace vog
