#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "lib/occupancy/occupancy_map.h"
#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"

namespace vog {

/// A submap at its pose. sigma_m: how uncertain the vehicle is sideways relative to it.
struct PlacedSubmap {
  SubmapPtr submap;
  Pose3 X_WM, X_MW;
  Eigen::AlignedBox3d bounds_M;  ///< Holds all its known voxels.
  double sigma_m = 0;
};

/// A map made of submaps m_i at poses X_WMi, eq. 1, which may move. What is kept of them is the
/// same for all ways to answer; VogMap is the one to use, the others are baselines.
class SubmapMap : public OccupancyMap {
 public:
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
  void NoteOpenGrew();
  /// The open submap and its pose, as SetOpen() was told.
  const BrickGrid* open() const { return open_; }
  const Pose3& X_open_W() const { return X_open_W_; }

  std::int64_t revision() const override { return revision_; }
  std::optional<std::vector<Eigen::AlignedBox3d>> ChangedSince(
      std::int64_t revision) const override;

  /// Tells how uncertain the vehicle is sideways relative to the submaps (standard deviations [m]),
  /// for SigmaOf(). Submaps that are not named keep what they had; 0 at first.
  void SetSigmas(const std::vector<std::pair<SubmapId, double>>& sigmas_m);
  /// The same for the motion since the newest closed submap, which comes on top of all of them.
  void SetSigmaSince(double sigma_m) { sigma_since_m_ = sigma_m; }
  void SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const override;
  double max_sigma_m() const override { return std::hypot(max_sigma_m_, sigma_since_m_); }
  /// As SetSigmas() told it. @throws std::out_of_range for a number that the map does not hold.
  double sigma_m(SubmapId id) const { return placed_.at(id).sigma_m; }
  /// Grows whenever the closed submaps, their poses or their sigmas change.
  std::int64_t sigma_revision() const { return sigma_revision_; }

  int size() const { return static_cast<int>(placed_.size()); }
  bool Has(SubmapId id) const { return placed_.count(id) > 0; }
  /// @throws std::out_of_range for a number that the map does not hold.
  const Pose3& X_WM(SubmapId id) const { return placed_.at(id).X_WM; }
  SubmapPtr submap(SubmapId id) const { return placed_.at(id).submap; }
  std::vector<SubmapId> ids() const;

  /// The box of all known space in W, empty without any.
  Eigen::AlignedBox3d Bounds() const;

 protected:
  SubmapMap(double voxel_size_m, const SensorModel& model);

  /// Called with each change of the closed submaps: what was there before and what is there now,
  /// one of them nullptr when a submap comes or goes. `after` stays where it is until it is
  /// removed.
  virtual void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) = 0;
  /// Called when the open submap or its pose is another one, and when it has grown.
  virtual void OnOpenChange() = 0;

  const SensorModel& model() const { return model_; }
  const std::map<SubmapId, PlacedSubmap>& placed() const { return placed_; }

  /// Eq. 5 at the point itself, from all submaps.
  float DirectLogOddsAt(const Vec3& p_W) const;

  /// The least sigma of the submaps among `candidates` that make `p_W` occupied; infinite without.
  template <class Candidates>
  double LeastSigmaAt(const Candidates& candidates, const Vec3& p_W) const;
  /// SigmaOf() at `p_W`, where the closed submaps say `least_sigma_m`.
  double SigmaAt(const Vec3& p_W, double least_sigma_m) const;

 private:
  struct ChangedBox {
    std::int64_t revision;
    Eigen::AlignedBox3d box_W;
  };

  void NoteChanged(const Eigen::AlignedBox3d& box_W);
  void NoteChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after);
  void NoteOpenChanged();
  void NoteSigmas();
  bool IsOccupiedIn(const BrickGrid& grid, const Pose3& X_MW, const Vec3& p_W) const;

  SensorModel model_;
  std::map<SubmapId, PlacedSubmap> placed_;
  const BrickGrid* open_ = nullptr;
  Pose3 X_open_W_ = Pose3::Identity();
  double sigma_since_m_ = 0, max_sigma_m_ = 0;
  std::int64_t sigma_revision_ = 0;
  std::int64_t revision_ = 0;
  std::deque<ChangedBox> changed_;  // The newest, oldest first.
  std::int64_t told_from_ = 0;      // changed_ holds all changes after this revision.
  Eigen::AlignedBox3d open_box_W_;  // Of the open submap when it was last shown.
};

template <class Candidates>
double SubmapMap::LeastSigmaAt(const Candidates& candidates, const Vec3& p_W) const {
  double least_m = std::numeric_limits<double>::infinity();
  for (const PlacedSubmap* placed : candidates) {
    if (placed->sigma_m >= least_m) continue;
    if (IsOccupiedIn(placed->submap->grid, placed->X_MW, p_W)) least_m = placed->sigma_m;
  }
  return least_m;
}

}  // namespace vog
