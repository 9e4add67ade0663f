#pragma once

#include <cstdint>
#include <vector>

#include "lib/scan/scan.h"
#include "lib/submap/brick_grid.h"
#include "lib/submap/ray_walker.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// Adds scans to a grid, eq. 2-4: log-odds are added and clamped; in one scan a voxel is updated at
/// most once, and a hit wins over a pass. Voxel for voxel and bit for bit what OctoMap's
/// insertPointCloud does with the same end points, except that nothing is cleared nearer than the
/// window's start.
class ScanInserter {
 public:
  ScanInserter(const SensorModel& model, double voxel_size_m, WalkForm form = FastestWalkForm());

  /// Adds `scan`, taken with the body at `X_MB`, to `grid`. @pre always the same grid, never
  /// made compact between: the inserter remembers which of its voxels a scan has touched.
  void Insert(const Scan& scan, const Pose3& X_MB, BrickGrid& grid);

  /// The same for a cloud of end points seen from `origin_M`, in M.
  void Insert(const std::vector<Vec3>& points_M, const Vec3& origin_M, BrickGrid& grid);

  /// Adds the end points alone.
  void InsertHits(const std::vector<Vec3>& points_M, BrickGrid& grid);

 private:
  /// Starts a scan, whose rays and hits come next.
  void Begin();
  void Insert(BrickGrid& grid);
  void Update(const VoxelKey& key, LogOddsUnits change, BrickGrid& grid);
  void EnterBrick(const VoxelKey& key, BrickGrid& grid);

  SensorModel model_;
  RayWalker walker_;
  std::vector<Ray> rays_;              // Of the scan; kept for their memory.
  std::vector<Eigen::Vector3f> hits_;  // Likewise.
  // Which scan touched each voxel last, parallel to the grid's bricks. The numbers of scans go
  // round.
  std::vector<std::uint8_t> touched_;
  std::uint8_t scan_ = 0;

  // The brick of the last voxel, since the next is mostly in it too.
  VoxelKey last_;
  LogOddsUnits* units_ = nullptr;
  std::uint8_t* touched_in_brick_ = nullptr;
};

}  // namespace vog
