#pragma once

#include <memory>
#include <vector>

#include "lib/submap/sensor_model.h"
#include "lib/submap/submap.h"
#include "tools/map/bench_scene.h"

namespace vog {

/// One submap as OctoMap holds it: a pruned octree.
class OctomapSubmap {
 public:
  explicit OctomapSubmap(const BrickGrid& grid);
  ~OctomapSubmap();

  std::size_t memory_bytes() const;

  /// How many of `points_M` the octree knows, by its own search from the root.
  std::size_t CountKnown(const std::vector<Vec3>& points_M) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

/// How fast scans become submaps here and in OctoMap.
struct InsertionFigures {
  double mbeams_s = 0, octomap_mbeams_s = 0;  ///< Million beams a second.
  std::int64_t differences = 0;               ///< Voxels of the two results that are not the same.
};

/// Adds the echoes of the first `submaps` submaps' scans, each submap into an empty grid, with
/// ScanInserter and with octomap::OcTree::insertPointCloud(), both with the same log-odds.
InsertionFigures MeasureInsertion(const BenchScene& scene, int submaps, int repeats);

}  // namespace vog
