#include "lib/vogmap/cautious_map.h"

#include <algorithm>
#include <utility>

namespace vog {

CautiousMap::CautiousMap(const SubmapMap& all, std::unique_ptr<SubmapMap> sure)
    : OccupancyMap(all.grid().voxel_size_m(), all.occupied_from()),
      all_(all),
      sure_(std::move(sure)) {
  past_.emplace_back();
}

void CautiousMap::Follow(double sure_sigma_m) {
  constexpr std::size_t kMost = 4096;
  const bool is_open_new = all_.revision() != past_.back().all;
  const bool are_closed_new =
      all_.sigma_revision() != followed_ || sure_sigma_m != followed_sigma_m_;
  if (are_closed_new) FollowClosed(sure_sigma_m);
  if (overrules_ && (is_open_new || are_closed_new))
    sure_->SetOpen(all_.open(), all_.X_open_W().inverse());
  const Revisions now{all_.revision(), sure_->revision(), overrules_};
  if (now == past_.back()) return;
  ++revision_;
  past_.push_back(now);
  if (past_.size() > kMost) past_.pop_front();
}

void CautiousMap::FollowClosed(double sure_sigma_m) {
  followed_ = all_.sigma_revision();
  followed_sigma_m_ = sure_sigma_m;
  const std::vector<SubmapId> ids = all_.ids();
  const auto is_sure = [&](SubmapId id) { return all_.sigma_m(id) <= sure_sigma_m; };
  overrules_ = !std::all_of(ids.begin(), ids.end(), is_sure);
  if (!overrules_) return;
  for (const SubmapId id : sure_->ids())
    if (!all_.Has(id) || !is_sure(id)) sure_->Remove(id);
  for (const SubmapId id : ids) {
    if (!is_sure(id)) continue;
    const bool is_here = sure_->Has(id) && sure_->submap(id) == all_.submap(id) &&
                         sure_->X_WM(id).matrix() == all_.X_WM(id).matrix();
    if (!is_here) sure_->Place(all_.submap(id), all_.X_WM(id));
  }
}

void CautiousMap::Overrule(std::span<const float> sure, std::span<float> log_odds) {
  for (std::size_t i = 0; i < sure.size(); ++i)
    if (IsKnown(sure[i])) log_odds[i] = sure[i];
}

std::span<const float> CautiousMap::SureLogOddsOf(std::span<const VoxelKey> voxels) const {
  sure_log_odds_.resize(voxels.size());
  sure_->LogOddsOf(voxels, sure_log_odds_);
  return sure_log_odds_;
}

void CautiousMap::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  all_.LogOddsAt(points_W, log_odds);
  if (!overrules_) return;
  sure_log_odds_.resize(points_W.size());
  sure_->LogOddsAt(points_W, sure_log_odds_);
  Overrule(sure_log_odds_, log_odds);
}

void CautiousMap::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  all_.LogOddsOf(voxels, log_odds);
  if (overrules_) Overrule(SureLogOddsOf(voxels), log_odds);
}

void CautiousMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  all_.LogOddsIn(box, log_odds);
  if (!overrules_) return;
  sure_->LogOddsIn(box, sure_log_odds_);
  Overrule(sure_log_odds_, log_odds);
}

void CautiousMap::NotFreeIn(const VoxelBox& box, std::vector<VoxelAnswer>& voxels) const {
  all_.NotFreeIn(box, voxels);
  if (!overrules_) return;
  keys_.clear();
  for (const VoxelAnswer& voxel : voxels) keys_.push_back(voxel.key);
  const std::span<const float> sure = SureLogOddsOf(keys_);
  // Occupied ones come again, all in one order.
  std::size_t i = 0;
  std::erase_if(voxels, [&](const VoxelAnswer&) { return IsKnown(sure[i++]); });
  sure_->NotFreeIn(box, sure_not_free_);
  for (const VoxelAnswer& voxel : sure_not_free_)
    if (IsOccupied(voxel.log_odds)) voxels.push_back(voxel);
}

void CautiousMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                          std::vector<RayVoxel>& ray) const {
  all_.CastRay(origin_W, direction_W, range_m, ray);
}

std::optional<RayVoxel> CautiousMap::FirstHit(const Vec3& origin_W, const Vec3& direction_W,
                                              double range_m) const {
  return all_.FirstHit(origin_W, direction_W, range_m);
}

void CautiousMap::SeeUnknown(const Vec3& origin_W, std::span<const Vec3> directions_W,
                             double min_range_m, double range_m, const EndsRay& ends,
                             std::vector<VoxelKey>& unknown) const {
  all_.SeeUnknown(origin_W, directions_W, min_range_m, range_m, ends, unknown);
}

void CautiousMap::SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
  all_.SigmaOf(voxels, sigma_m);
}

bool CautiousMap::IsSurelyKnown(std::span<const VoxelKey> voxels) const {
  if (!overrules_) return true;
  const std::span<const float> sure = SureLogOddsOf(voxels);
  return std::all_of(sure.begin(), sure.end(), IsKnown);
}

std::optional<std::vector<Eigen::AlignedBox3d>> CautiousMap::ChangedSince(
    std::int64_t revision) const {
  const std::int64_t back = revision_ - revision;
  if (back < 0 || back >= static_cast<std::int64_t>(past_.size())) return std::nullopt;
  const Revisions& then = past_[past_.size() - 1 - static_cast<std::size_t>(back)];
  if (then.overrules != overrules_) return std::nullopt;
  auto boxes_W = all_.ChangedSince(then.all);
  if (!boxes_W || !overrules_) return boxes_W;
  const auto sure_W = sure_->ChangedSince(then.sure);
  if (!sure_W) return std::nullopt;
  boxes_W->insert(boxes_W->end(), sure_W->begin(), sure_W->end());
  return boxes_W;
}

}  // namespace vog
