#pragma once

#include <algorithm>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "lib/occupancy/occupancy_map.h"

/// A map for tests.
namespace vog {

/// Whatever voxels it is told; all others are unknown.
class GridMap final : public OccupancyMap {
 public:
  static constexpr float kOccupied = 2, kFree = -2;

  explicit GridMap(double voxel_size_m) : OccupancyMap(voxel_size_m, 0) {}

  void Set(const VoxelKey& key, float log_odds) {
    if (kNear.Contains(key)) {
      near_[kNear.IndexOf(key)] = log_odds;
    } else {
      far_[key] = log_odds;
    }
    ++revision_;
  }
  void Fill(const VoxelBox& box, float log_odds) {
    ForEachVoxel(box, [&](const VoxelKey& key) { Set(key, log_odds); });
  }
  float Get(const VoxelKey& key) const {
    if (kNear.Contains(key)) return near_[kNear.IndexOf(key)];
    const auto found = far_.find(key);
    return found == far_.end() ? kUnknownLogOdds : found->second;
  }

  /// Gives each occupied voxel the sigma that `draw()` returns.
  template <class Draw>
  void SetSigmas(Draw draw) {
    const auto set = [&](const VoxelKey& key) {
      if (!IsOccupied(Get(key))) return;
      sigma_m_[key] = static_cast<float>(draw());
      max_sigma_m_ = std::max<double>(max_sigma_m_, sigma_m_[key]);
    };
    ForEachVoxel(kNear, set);
    for (const auto& [key, log_odds] : far_) set(key);
  }
  /// The same sigma for all occupied voxels without one of their own, also those to come.
  void SetSigma(double sigma_m) {
    sigma_of_others_m_ = sigma_m;
    max_sigma_m_ = std::max(max_sigma_m_, sigma_m);
  }
  double SigmaAt(const VoxelKey& key) const {
    const auto found = sigma_m_.find(key);
    return found == sigma_m_.end() ? sigma_of_others_m_ : found->second;
  }

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override {
    for (std::size_t i = 0; i < points_W.size(); ++i) log_odds[i] = Get(grid().KeyOf(points_W[i]));
  }
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override {
    ReadVoxels(voxels, log_odds, [this](const VoxelKey& key) { return Get(key); });
  }
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override {
    ReadBox(box, log_odds, [this](const VoxelKey& key) { return Get(key); });
  }
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override {
    WalkRay(origin_W, direction_W, range_m, ray, [this](const VoxelKey& key) { return Get(key); });
  }
  void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const override {
    for (std::size_t i = 0; i < voxels.size(); ++i)
      sigma_m[i] = static_cast<float>(SigmaAt(voxels[i]));
  }
  double max_sigma_m() const override { return max_sigma_m_; }
  void SetUnsure(std::set<VoxelKey> unsure) { unsure_ = std::move(unsure); }
  void SetAllUnsure(bool are_unsure) { are_all_unsure_ = are_unsure; }
  bool IsSurelyKnown(std::span<const VoxelKey> voxels) const override {
    return !are_all_unsure_ && std::none_of(voxels.begin(), voxels.end(), [&](const VoxelKey& v) {
      return unsure_.count(v) > 0;
    });
  }
  bool IsSure() const override { return !are_all_unsure_ && unsure_.empty(); }
  std::int64_t revision() const override { return revision_; }

 private:
  static constexpr VoxelBox kNear = {{-32, -32, -32}, {31, 31, 31}};
  std::vector<float> near_ = std::vector<float>(kNear.count(), kUnknownLogOdds);
  std::unordered_map<VoxelKey, float> far_, sigma_m_;
  double sigma_of_others_m_ = 0, max_sigma_m_ = 0;
  std::set<VoxelKey> unsure_;
  bool are_all_unsure_ = false;
  std::int64_t revision_ = 0;
};

}  // namespace vog
