#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "lib/geometry/pose.h"
#include "lib/geometry/voxel_grid.h"

namespace vog {

/// Log-odds of occupancy where nothing was observed, which is not log-odds 0.
inline constexpr float kUnknownLogOdds = std::numeric_limits<float>::quiet_NaN();

inline bool IsKnown(float log_odds) { return log_odds == log_odds; }

enum class VoxelState { kUnknown, kFree, kOccupied };

/// A box of voxels, both corners included.
struct VoxelBox {
  VoxelKey min, max;

  std::int64_t size_x() const { return std::int64_t{max.x} - min.x + 1; }
  std::int64_t size_y() const { return std::int64_t{max.y} - min.y + 1; }
  std::int64_t size_z() const { return std::int64_t{max.z} - min.z + 1; }
  std::size_t count() const { return static_cast<std::size_t>(size_x() * size_y() * size_z()); }
  bool IsEmpty() const { return size_x() <= 0 || size_y() <= 0 || size_z() <= 0; }
  bool Contains(const VoxelKey& key) const {
    return key.x >= min.x && key.x <= max.x && key.y >= min.y && key.y <= max.y && key.z >= min.z &&
           key.z <= max.z;
  }
  /// Place of a voxel in an array of the box: x runs fastest, then y. @pre Contains(key).
  std::size_t IndexOf(const VoxelKey& key) const {
    return static_cast<std::size_t>(
        (std::int64_t{key.z - min.z} * size_y() + (key.y - min.y)) * size_x() + (key.x - min.x));
  }
  /// The inverse of IndexOf(). @pre index < count().
  VoxelKey KeyOf(std::size_t index) const {
    const auto i = static_cast<std::int64_t>(index);
    const std::int64_t row = i / size_x();
    return {min.x + static_cast<std::int32_t>(i % size_x()),
            min.y + static_cast<std::int32_t>(row % size_y()),
            min.z + static_cast<std::int32_t>(row / size_y())};
  }
};

/// What both hold; empty where they do not meet.
inline VoxelBox Intersection(const VoxelBox& a, const VoxelBox& b) {
  return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
          {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}

/// Calls `visit(voxel)` for each voxel of `box`, in the order of VoxelBox::IndexOf.
template <class Visit>
void ForEachVoxel(const VoxelBox& box, Visit visit) {
  for (std::int32_t z = box.min.z; z <= box.max.z; ++z)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t x = box.min.x; x <= box.max.x; ++x) visit(VoxelKey{x, y, z});
}

/// The smallest box of voxels that holds `bounds_W`.
inline VoxelBox VoxelsOf(const VoxelGrid& grid, const Eigen::AlignedBox3d& bounds_W) {
  return {grid.KeyOf(bounds_W.min()), grid.KeyOf(bounds_W.max())};
}

/// A voxel on a ray.
struct RayVoxel {
  VoxelKey key;
  float entered_m = 0;  ///< Distance from the ray's origin at which it enters the voxel.
  float log_odds = kUnknownLogOdds;
};

/// A voxel and its answer.
struct VoxelAnswer {
  VoxelKey key;
  float log_odds = kUnknownLogOdds;
};

/// All that a planner or an evaluation may ask of a map, in W. Answers are log-odds of occupancy;
/// kUnknownLogOdds where nothing was observed. Queries are const but may fill caches: use a map
/// from one thread at a time.
class OccupancyMap {
 public:
  virtual ~OccupancyMap() = default;

  /// The answer at each point itself. @pre the spans are of one size.
  virtual void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const = 0;

  /// The answer at the centre of each voxel of grid(). @pre the spans are of one size.
  virtual void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const = 0;

  /// Replaces `log_odds` by the answers at the centres of all voxels of `box`, in the order of
  /// VoxelBox::IndexOf.
  virtual void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const = 0;

  /// Replaces `voxels` by those of `box` that are not free: occupied or unknown. In an order that
  /// depends on the box alone.
  virtual void NotFreeIn(const VoxelBox& box, std::vector<VoxelAnswer>& voxels) const {
    std::vector<float> log_odds;
    LogOddsIn(box, log_odds);
    voxels.clear();
    std::size_t i = 0;
    ForEachVoxel(box, [&](const VoxelKey& voxel) {
      if (!IsFree(log_odds[i])) voxels.push_back({voxel, log_odds[i]});
      ++i;
    });
  }

  /// Replaces `ray` by the voxels from `origin_W` along the unit vector `direction_W`, up to
  /// `range_m` or to the first occupied one, which is included.
  virtual void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                       std::vector<RayVoxel>& ray) const = 0;

  /// The first occupied voxel on a ray like CastRay()'s.
  virtual std::optional<RayVoxel> FirstHit(const Vec3& origin_W, const Vec3& direction_W,
                                           double range_m) const {
    std::vector<RayVoxel> ray;
    CastRay(origin_W, direction_W, range_m, ray);
    if (ray.empty() || !IsOccupied(ray.back().log_odds)) return std::nullopt;
    return ray.back();
  }

  /// Whether a view's ray, which has come to an unknown voxel, ends there.
  using EndsRay = std::function<bool(const VoxelKey&)>;

  /// Replaces `unknown` by the unknown voxels that the rays of a view enter at `min_range_m` or
  /// beyond, before they end as CastRay()'s do, or in one of these that `ends` says, if there is
  /// such a function: ray by ray, each ray's in their order.
  virtual void SeeUnknown(const Vec3& origin_W, std::span<const Vec3> directions_W,
                          double min_range_m, double range_m, const EndsRay& ends,
                          std::vector<VoxelKey>& unknown) const {
    unknown.clear();
    std::vector<RayVoxel> ray;
    for (const Vec3& direction_W : directions_W) {
      CastRay(origin_W, direction_W, range_m, ray);
      for (const RayVoxel& voxel : ray) {
        if (IsKnown(voxel.log_odds) || voxel.entered_m < min_range_m) continue;
        unknown.push_back(voxel.key);
        if (ends && ends(voxel.key)) break;
      }
    }
  }

  /// How far the content of each voxel may lie sideways from where the map shows it, seen from the
  /// vehicle: standard deviation [m] of the best placed observation that makes it occupied. 0 where
  /// a map does not know, and for voxels that are not occupied. @pre the spans are of one size.
  virtual void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
    std::fill_n(sigma_m.begin(), voxels.size(), 0.0f);
  }
  /// The largest that SigmaOf() may answer.
  virtual double max_sigma_m() const { return 0; }

  /// Whether each of `voxels` was seen by an observation that is surely placed, seen from the
  /// vehicle.
  virtual bool IsSurelyKnown(std::span<const VoxelKey> /*voxels*/) const { return true; }
  /// Whether all observations are surely placed, so that all is surely known.
  virtual bool IsSure() const { return true; }

  /// Grows whenever an answer may have changed.
  virtual std::int64_t revision() const = 0;

  /// Boxes in W outside of which no answer has changed since the map had `revision`; nothing if
  /// that is too long ago to tell.
  virtual std::optional<std::vector<Eigen::AlignedBox3d>> ChangedSince(
      std::int64_t revision) const {
    if (revision != this->revision()) return std::nullopt;
    return std::vector<Eigen::AlignedBox3d>();
  }

  const VoxelGrid& grid() const { return grid_; }

  float occupied_from() const { return occupied_from_; }
  bool IsOccupied(float log_odds) const { return log_odds >= occupied_from_; }
  bool IsFree(float log_odds) const { return log_odds < occupied_from_; }
  VoxelState StateOf(float log_odds) const {
    return IsOccupied(log_odds) ? VoxelState::kOccupied
           : IsFree(log_odds)   ? VoxelState::kFree
                                : VoxelState::kUnknown;
  }

 protected:
  OccupancyMap(double voxel_size_m, float occupied_from)
      : grid_(voxel_size_m), occupied_from_(occupied_from) {}

  /// The voxel loops of LogOddsOf(), LogOddsIn() and CastRay() over a map's
  /// `log_odds_of(VoxelKey)`.
  template <class LogOddsOfVoxel>
  static void ReadVoxels(std::span<const VoxelKey> voxels, std::span<float> log_odds,
                         LogOddsOfVoxel log_odds_of) {
    for (std::size_t i = 0; i < voxels.size(); ++i) log_odds[i] = log_odds_of(voxels[i]);
  }
  template <class LogOddsOfVoxel>
  static void ReadBox(const VoxelBox& box, std::vector<float>& log_odds,
                      LogOddsOfVoxel log_odds_of) {
    log_odds.resize(box.count());
    std::size_t i = 0;
    ForEachVoxel(box, [&](const VoxelKey& voxel) { log_odds[i++] = log_odds_of(voxel); });
  }
  template <class LogOddsOfVoxel>
  void WalkRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray, LogOddsOfVoxel log_odds_of) const {
    ray.clear();
    WalkVoxels(grid_, origin_W, direction_W, range_m, [&](const VoxelKey& key, double entered_m) {
      const float log_odds = log_odds_of(key);
      ray.push_back({key, static_cast<float>(entered_m), log_odds});
      return !IsOccupied(log_odds);
    });
  }

 private:
  VoxelGrid grid_;
  float occupied_from_;
};

}  // namespace vog
