#include "lib/vogmap/submap_map.h"

#include <cmath>

#include "lib/vogmap/log_odds_sum.h"

namespace vog {
namespace {

/// The box in W around one in M.
Eigen::AlignedBox3d BoxOf(const Eigen::AlignedBox3d& box_M, const Pose3& X_WM) {
  Eigen::AlignedBox3d box_W;
  if (box_M.isEmpty()) return box_W;
  for (int corner = 0; corner < 8; ++corner)
    box_W.extend(X_WM * box_M.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  return box_W;
}

}  // namespace

SubmapMap::SubmapMap(double voxel_size_m, const SensorModel& model)
    : OccupancyMap(voxel_size_m, ToLogOdds(model.occupied_from)), model_(model) {}

void SubmapMap::Place(SubmapPtr submap, const Pose3& X_WM) {
  const SubmapId id = submap->id();
  const auto found = placed_.find(id);
  PlacedSubmap after{std::move(submap), X_WM, X_WM.inverse(), {}, 0};
  after.bounds_M = after.submap->grid.BrickBounds();
  ++revision_;
  if (found == placed_.end()) {
    NoteChange(id, nullptr, &placed_.emplace(id, std::move(after)).first->second);
    return;
  }
  after.sigma_m = found->second.sigma_m;
  const PlacedSubmap before = std::exchange(found->second, std::move(after));
  NoteChange(id, &before, &found->second);
}

void SubmapMap::Move(const std::vector<std::pair<SubmapId, Pose3>>& poses_WM) {
  ++revision_;
  for (const auto& [id, X_WM] : poses_WM) {
    const auto found = placed_.find(id);
    if (found == placed_.end() || found->second.X_WM.matrix() == X_WM.matrix()) continue;
    const PlacedSubmap before = found->second;
    found->second.X_WM = X_WM;
    found->second.X_MW = X_WM.inverse();
    NoteChange(id, &before, &found->second);
  }
}

void SubmapMap::Remove(SubmapId id) {
  ++revision_;
  const auto found = placed_.find(id);
  if (found == placed_.end()) return;
  const PlacedSubmap before = std::move(found->second);
  placed_.erase(found);
  NoteChange(id, &before, nullptr);
  NoteSigmas();
}

void SubmapMap::SetOpen(const BrickGrid* open, const Pose3& X_WM) {
  open_ = open;
  X_open_W_ = X_WM.inverse();
  ++revision_;
  NoteOpenChanged();
}

void SubmapMap::NoteOpenGrew() {
  ++revision_;
  NoteOpenChanged();
}

float SubmapMap::DirectLogOddsAt(const Vec3& p_W) const {
  LogOddsSum sum;
  const auto add = [&](const BrickGrid& grid, const Pose3& X_MW) {
    sum.Add(grid.Get(grid.grid().KeyOf(X_MW * p_W)));
  };
  for (const auto& [id, placed] : placed_) add(placed.submap->grid, placed.X_MW);
  if (open_ != nullptr) add(*open_, X_open_W_);
  return sum.Clamped(model_);
}

void SubmapMap::NoteChanged(const Eigen::AlignedBox3d& box_W) {
  constexpr std::size_t kMost = 4096;
  if (box_W.isEmpty()) return;
  // The open submap grows with every scan.
  while (!changed_.empty() && box_W.contains(changed_.back().box_W)) changed_.pop_back();
  changed_.push_back({revision_, box_W});
  if (changed_.size() <= kMost) return;
  told_from_ = changed_.front().revision;
  changed_.pop_front();
}

void SubmapMap::NoteChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) {
  for (const PlacedSubmap* placed : {before, after}) {
    if (placed != nullptr) NoteChanged(BoxOf(placed->bounds_M, placed->X_WM));
  }
  ++sigma_revision_;
  OnChange(id, before, after);
}

void SubmapMap::NoteOpenChanged() {
  NoteChanged(open_box_W_);
  open_box_W_ =
      open_ == nullptr ? Eigen::AlignedBox3d() : BoxOf(open_->BrickBounds(), X_open_W_.inverse());
  NoteChanged(open_box_W_);
  OnOpenChange();
}

std::optional<std::vector<Eigen::AlignedBox3d>> SubmapMap::ChangedSince(
    std::int64_t revision) const {
  if (revision < told_from_) return std::nullopt;
  std::vector<Eigen::AlignedBox3d> boxes_W;
  for (const ChangedBox& changed : changed_) {
    if (changed.revision > revision) boxes_W.push_back(changed.box_W);
  }
  return boxes_W;
}

void SubmapMap::SetSigmas(const std::vector<std::pair<SubmapId, double>>& sigmas_m) {
  for (const auto& [id, sigma_m] : sigmas_m) {
    const auto found = placed_.find(id);
    if (found != placed_.end()) found->second.sigma_m = sigma_m;
  }
  NoteSigmas();
}

void SubmapMap::NoteSigmas() {
  ++sigma_revision_;
  max_sigma_m_ = 0;
  for (const auto& [id, placed] : placed_) max_sigma_m_ = std::max(max_sigma_m_, placed.sigma_m);
}

double SubmapMap::SigmaAt(const Vec3& p_W, double least_sigma_m) const {
  if (open_ != nullptr && IsOccupiedIn(*open_, X_open_W_, p_W)) return sigma_since_m_;
  return std::isinf(least_sigma_m) ? 0 : std::hypot(least_sigma_m, sigma_since_m_);
}

bool SubmapMap::IsOccupiedIn(const BrickGrid& grid, const Pose3& X_MW, const Vec3& p_W) const {
  const LogOddsUnits units = grid.Get(grid.grid().KeyOf(X_MW * p_W));
  return units != kUnknownUnits && units >= model_.occupied_from;
}

void SubmapMap::SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
  std::vector<const PlacedSubmap*> all;
  for (const auto& [id, placed] : placed_) all.push_back(&placed);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const Vec3 center_W = grid().CenterOf(voxels[i]);
    sigma_m[i] = static_cast<float>(SigmaAt(center_W, LeastSigmaAt(all, center_W)));
  }
}

std::vector<SubmapId> SubmapMap::ids() const {
  std::vector<SubmapId> ids;
  for (const auto& [id, placed] : placed_) ids.push_back(id);
  return ids;
}

Eigen::AlignedBox3d SubmapMap::Bounds() const {
  Eigen::AlignedBox3d bounds_W;
  for (const auto& [id, placed] : placed_)
    bounds_W.extend(BoxOf(placed.submap->grid.Bounds(), placed.X_WM));
  if (open_ != nullptr) bounds_W.extend(BoxOf(open_->Bounds(), X_open_W_.inverse()));
  return bounds_W;
}

}  // namespace vog
