#include "lib/vogmap/submap_map.h"

#include <cmath>

#include "lib/vogmap/log_odds_sum.h"

namespace vog {

SubmapMap::SubmapMap(double voxel_size_m, const SensorModel& model)
    : OccupancyMap(voxel_size_m, ToLogOdds(model.occupied_from)), model_(model) {}

void SubmapMap::Place(SubmapPtr submap, const Pose3& X_WM) {
  const SubmapId id = submap->id();
  const auto found = placed_.find(id);
  PlacedSubmap after{std::move(submap), X_WM, X_WM.inverse(), {}, 0};
  after.bounds_M = after.submap->grid.BrickBounds();
  ++revision_;
  if (found == placed_.end()) {
    OnChange(id, nullptr, &placed_.emplace(id, std::move(after)).first->second);
    return;
  }
  after.sigma_m = found->second.sigma_m;
  const PlacedSubmap before = std::exchange(found->second, std::move(after));
  OnChange(id, &before, &found->second);
}

void SubmapMap::Move(const std::vector<std::pair<SubmapId, Pose3>>& poses_WM) {
  ++revision_;
  for (const auto& [id, X_WM] : poses_WM) {
    const auto found = placed_.find(id);
    if (found == placed_.end() || found->second.X_WM.matrix() == X_WM.matrix()) continue;
    const PlacedSubmap before = found->second;
    found->second.X_WM = X_WM;
    found->second.X_MW = X_WM.inverse();
    OnChange(id, &before, &found->second);
  }
}

void SubmapMap::Remove(SubmapId id) {
  ++revision_;
  const auto found = placed_.find(id);
  if (found == placed_.end()) return;
  const PlacedSubmap before = std::move(found->second);
  placed_.erase(found);
  OnChange(id, &before, nullptr);
}

void SubmapMap::SetOpen(const BrickGrid* open, const Pose3& X_WM) {
  open_ = open;
  X_open_W_ = X_WM.inverse();
  ++revision_;
  OnOpenChange();
}

void SubmapMap::NoteOpenGrew() {
  ++revision_;
  OnOpenChange();
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

void SubmapMap::SetSigmas(const std::vector<std::pair<SubmapId, double>>& sigmas_m) {
  for (const auto& [id, sigma_m] : sigmas_m) {
    const auto found = placed_.find(id);
    if (found != placed_.end()) found->second.sigma_m = sigma_m;
  }
}

double SubmapMap::max_sigma_m() const {
  double max_m = 0;
  for (const auto& [id, placed] : placed_) max_m = std::max(max_m, placed.sigma_m);
  return std::hypot(max_m, sigma_since_m_);
}

bool SubmapMap::IsOccupiedIn(const BrickGrid& grid, const Pose3& X_MW, const Vec3& p_W) const {
  const LogOddsUnits units = grid.Get(grid.grid().KeyOf(X_MW * p_W));
  return units != kUnknownUnits && units >= model_.occupied_from;
}

void SubmapMap::SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
  std::vector<const PlacedSubmap*> all;
  for (const auto& [id, placed] : placed_) all.push_back(&placed);
  for (std::size_t i = 0; i < voxels.size(); ++i)
    sigma_m[i] = static_cast<float>(SigmaAt(all, grid().CenterOf(voxels[i])));
}

std::vector<SubmapId> SubmapMap::ids() const {
  std::vector<SubmapId> ids;
  for (const auto& [id, placed] : placed_) ids.push_back(id);
  return ids;
}

Eigen::AlignedBox3d SubmapMap::Bounds() const {
  Eigen::AlignedBox3d bounds_W;
  const auto extend = [&](const Eigen::AlignedBox3d& box_M, const Pose3& X_WM) {
    for (int corner = 0; corner < 8; ++corner)
      bounds_W.extend(X_WM * box_M.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  };
  for (const auto& [id, placed] : placed_) {
    if (!placed.bounds_M.isEmpty()) extend(placed.submap->grid.Bounds(), placed.X_WM);
  }
  if (open_ != nullptr && open_->bricks() > 0) extend(open_->Bounds(), X_open_W_.inverse());
  return bounds_W;
}

}  // namespace vog
