#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lib/geometry/view_walk.h"
#include "lib/vogmap/submap_map.h"

namespace vog {

/// A global occupancy grid that is never merged: submaps m_i at poses X_WMi, eq. 1. The answer at a
/// point, eq. 5, is
///
///   L(p_W) = clamp( sum_i L_i(X_WMi^-1 * p_W) )
///
/// over the submaps that observed the point, clamped once; where none did it is unknown. Sums are
/// of whole units, so that their order does not matter.
///
/// LogOddsAt() evaluates the points themselves (`direct`). The other queries evaluate the centres
/// of global voxels when they are first asked for and remember the answers (`cached`): bit for bit
/// what LogOddsAt() says there, in double arithmetic, whatever was added, moved or removed before,
/// and whatever instructions the machine has.
///
/// Cost. A remembered answer costs a look-up, however many submaps there are. A new one costs the
/// submaps whose bricks reach its block of 8 x 8 x 8 voxels, eight at a time where the machine has
/// AVX2. When few submaps change, a block takes their old part out of its sums and puts the new one
/// in when it is next asked for; when many do, it begins anew. What nobody asks for is never
/// computed. The open submap's part is not in the sums, so that it may grow at any time.
class VogMap final : public SubmapMap {
 public:
  VogMap(double voxel_size_m, const SensorModel& model);
  ~VogMap() override;
  VogMap(VogMap&&) noexcept;

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void NotFreeIn(const VoxelBox& box, std::vector<VoxelAnswer>& voxels) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;
  std::optional<RayVoxel> FirstHit(const Vec3& origin_W, const Vec3& direction_W,
                                   double range_m) const override;
  void SeeUnknown(const Vec3& origin_W, std::span<const Vec3> directions_W, double min_range_m,
                  double range_m, const EndsRay& ends,
                  std::vector<VoxelKey>& unknown) const override;
  void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const override;

  /// Gives the memory of remembered answers back; the answers stay.
  void ReleaseCache() const;

 private:
  class Cache;
  struct Gaze;

  void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) override;
  void OnOpenChange() override;
  /// Calls `visit(key, entered_m, units)` along a ray until it returns false.
  template <class Visit>
  void WalkAnswers(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                   Visit visit) const;
  /// Looks along the ray of a lane for a round; false once it has ended.
  bool Follow(const ViewWalk::Round& round, std::size_t lane, double min_range_m,
              const EndsRay& ends, Gaze& gaze) const;

  std::unique_ptr<Cache> cache_;
};

}  // namespace vog
