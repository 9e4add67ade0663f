#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "lib/occupancy/occupancy_map.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// A global occupancy grid that is never merged: submaps m_i at poses X_WMi, eq. 1. The answer at a
/// point, eq. 5, is
///
///   L(p_W) = clamp( sum_i L_i(X_WMi^-1 * p_W) )
///
/// over the submaps that observed the point, clamped once; where none did it is unknown. Sums are
/// of whole units, so that their order does not matter. Moving a submap therefore costs nothing
/// until somebody asks.
///
/// LogOddsAt() evaluates the points themselves (`direct`). The other queries evaluate the centres
/// of global voxels and remember the sum over the closed submaps until one is added, moved or
/// removed
/// (`cached`): bit for bit what LogOddsAt() says there. The open submap's part is never remembered,
/// so that it may grow at any time.
class VogMap final : public OccupancyMap {
 public:
  VogMap(double voxel_size_m, const SensorModel& model);
  ~VogMap() override;
  VogMap(VogMap&&) noexcept;

  /// Adds `submap` at `X_WM`, or moves and replaces it if its number is already in the map.
  /// @pre submap != nullptr.
  void Place(SubmapPtr submap, const Pose3& X_WM);

  /// Moves submaps; numbers that the map does not hold are passed over.
  void Move(const std::vector<std::pair<SubmapId, Pose3>>& poses_WM);

  void Remove(SubmapId id);

  /// Shows the submap that is being built, above all others; nullptr for none. It must outlive its
  /// stay here.
  void SetOpen(const BrickGrid* open, const Pose3& X_WM);
  /// To be called after the open submap has grown.
  void NoteOpenGrew() { ++revision_; }

  void LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const override;
  void LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const override;
  void LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const override;
  void CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
               std::vector<RayVoxel>& ray) const override;
  std::int64_t revision() const override { return revision_; }

  /// Tells how uncertain the vehicle is sideways relative to the submaps (standard deviations [m]),
  /// for SigmaOf(). Submaps that are not named keep what they had; 0 at first.
  void SetSigmas(const std::vector<std::pair<SubmapId, double>>& sigmas_m);
  /// The same for the motion since the newest closed submap, which comes on top of all of them.
  void SetSigmaSince(double sigma_m) { sigma_since_m_ = sigma_m; }
  void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const override;
  double max_sigma_m() const override;

  /// Gives the memory of remembered sums back; the answers stay.
  void ReleaseCache() const;

  int size() const { return static_cast<int>(placed_.size()); }
  bool Has(SubmapId id) const { return placed_.count(id) > 0; }
  /// @throws std::out_of_range for a number that the map does not hold.
  const Pose3& X_WM(SubmapId id) const { return placed_.at(id).X_WM; }
  SubmapPtr submap(SubmapId id) const { return placed_.at(id).submap; }
  std::vector<SubmapId> ids() const;

  /// The box of all known space in W, empty without any.
  Eigen::AlignedBox3d Bounds() const;

 private:
  struct Placed {
    SubmapPtr submap;
    Pose3 X_WM, X_MW;
    Eigen::AlignedBox3d bounds_M;
    double sigma_m = 0;
  };
  struct Block;

  void ForgetSums();
  std::int32_t SumAt(std::span<const Placed* const> candidates, const Vec3& p_W) const;
  float WithOpen(std::int32_t closed_sum, const Vec3& p_W) const;
  Block& BlockOf(const VoxelKey& voxel) const;
  double SigmaAt(std::span<const Placed* const> candidates, const Vec3& p_W) const;
  std::vector<const Placed*> CandidatesFor(const VoxelKey& block) const;
  float Evaluate(Block& block, int index, const VoxelKey& voxel) const;
  float LogOddsOfVoxel(const VoxelKey& voxel) const;

  SensorModel model_;
  std::map<SubmapId, Placed> placed_;
  const BrickGrid* open_ = nullptr;
  Pose3 X_open_W_ = Pose3::Identity();
  double sigma_since_m_ = 0;
  std::int64_t revision_ = 0;

  mutable std::unordered_map<VoxelKey, std::unique_ptr<Block>> blocks_;
  mutable VoxelKey last_block_key_;
  mutable Block* last_block_ = nullptr;
};

}  // namespace vog
