#pragma once

#include <deque>
#include <memory>

#include "lib/vogmap/submap_map.h"

namespace vog {

/// A map as a vehicle should fly by it: where submaps have seen anything that are surely placed,
/// seen from the vehicle, they decide; the others tell of the rest.
///
/// Eq. 5 sums what all submaps say of a voxel of W. Where their poses are wrong by more than the
/// structure is wide, the water that old ones saw there outvotes what stands there: a pile that the
/// sonar shows right now would not be in the map. Rays end where those of the whole map do.
class CautiousMap : public OccupancyMap {
 public:
  /// `all` must outlive this. `sure` is an empty map for this one's own use.
  CautiousMap(const SubmapMap& all, std::unique_ptr<SubmapMap> sure);

  /// Takes what `all` holds now; to be called whenever it has changed. A submap is surely placed
  /// when its sigma is at most `sure_sigma_m`; so is the open one. Cost: where all are, none.
  void Follow(double sure_sigma_m);

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
  double max_sigma_m() const override { return all_.max_sigma_m(); }
  bool IsSurelyKnown(std::span<const VoxelKey> voxels) const override;
  bool IsSure() const override { return !overrules_; }
  std::int64_t revision() const override { return revision_; }
  std::optional<std::vector<Eigen::AlignedBox3d>> ChangedSince(
      std::int64_t revision) const override;

 private:
  /// What the two maps were at at one of this one's revisions.
  struct Revisions {
    std::int64_t all = -1, sure = -1;
    bool overrules = false;
    bool operator==(const Revisions&) const = default;
  };

  void FollowClosed(double sure_sigma_m);
  /// What the sure ones say, good until the next call.
  std::span<const float> SureLogOddsOf(std::span<const VoxelKey> voxels) const;
  static void Overrule(std::span<const float> sure, std::span<float> log_odds);

  const SubmapMap& all_;
  std::unique_ptr<SubmapMap> sure_;
  bool overrules_ = false;  // Not all submaps are surely placed.
  std::int64_t followed_ = -1;
  double followed_sigma_m_ = -1;
  std::int64_t revision_ = 0;
  std::deque<Revisions> past_;  // Of the newest revisions, the present one last.
  // Scratch.
  mutable std::vector<VoxelKey> keys_;
  mutable std::vector<float> sure_log_odds_;
  mutable std::vector<VoxelAnswer> sure_not_free_;
};

}  // namespace vog
