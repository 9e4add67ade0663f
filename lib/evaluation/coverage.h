#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "lib/base/time.h"
#include "lib/geometry/triangle_mesh.h"
#include "lib/occupancy/occupancy_map.h"
#include "lib/scan/scan.h"

namespace vog {

/// A small, equal piece of a surface.
struct SurfaceSample {
  Vec3 position_W_m;
  Vec3 normal_W;
};

/// Spreads samples evenly over a mesh, one for each `spacing_m`^2 of area, the same ones each time.
std::vector<SurfaceSample> SampleSurface(const TriangleMesh& mesh_W, double spacing_m);

/// What an evaluation may ask of the true world.
struct TrueWorld {
  std::function<bool(const Vec3& from_W, const Vec3& to_W)> is_occluded;
  /// Whether the vehicle's box, at some heading, touches nothing there.
  std::function<bool(const Vec3& p_W)> hull_fits;
};

/// Where the vehicle can come to, and what can be seen from there: the shares that a perfect
/// exploration would reach.
class Reachability {
 public:
  /// Floods a lattice of `step_m` over the exploration box from `start_W`, through places where the
  /// hull fits.
  Reachability(const TrueWorld& world, const Eigen::AlignedBox3d& box_W, const Vec3& start_W,
               double step_m);

  const std::vector<Vec3>& places_W() const { return places_W_; }

  /// Whether a point is within `range_m` and in line of sight of some place; with a normal, on the
  /// side that it points to.
  bool IsVisible(const Vec3& p_W, double range_m, const Vec3* normal_W = nullptr) const;

 private:
  const TrueWorld& world_;
  std::vector<Vec3> places_W_;
};

/// Share of something over time.
struct CoverageCurve {
  struct Point {
    double time_s;
    double share;
  };
  std::vector<Point> points;

  double final_share() const { return points.empty() ? 0 : points.back().share; }
  /// The first time at which the share is reached, if it ever is [s].
  std::optional<double> TimeTo(double share) const;
};

/// Counts the reachable surface samples that the sonar has truly seen: an end point at the true
/// pose came within `tolerance_m` of the sample, from the side of its normal.
class SurfaceCoverage {
 public:
  SurfaceCoverage(std::vector<SurfaceSample> reachable, double tolerance_m);

  void AddScan(const Scan& scan, const Pose3& X_WB_true);

  const CoverageCurve& curve() const { return curve_; }
  const std::vector<SurfaceSample>& samples() const { return samples_; }
  const std::vector<bool>& seen() const { return seen_; }

 private:
  void SeeAround(const Vec3& end_W, const Vec3& direction_W);

  std::vector<SurfaceSample> samples_;
  double tolerance_m_;
  VoxelGrid cells_;
  std::unordered_map<VoxelKey, std::vector<std::uint32_t>> samples_in_cell_;
  std::vector<bool> seen_;
  std::size_t count_ = 0;
  CoverageCurve curve_;
};

/// Counts the reachable voxels of the exploration box that a beam has truly passed through or ended
/// in.
class VolumeCoverage {
 public:
  /// `reachable` has one entry for each voxel of `box`.
  VolumeCoverage(const VoxelGrid& grid, const VoxelBox& box, std::vector<bool> reachable);

  void AddScan(const Scan& scan, const Pose3& X_WB_true);

  const CoverageCurve& curve() const { return curve_; }

 private:
  VoxelGrid grid_;
  VoxelBox box_;
  std::vector<bool> missing_;
  std::size_t reachable_ = 0, seen_ = 0;
  CoverageCurve curve_;
};

}  // namespace vog
