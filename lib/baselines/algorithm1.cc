#include "lib/baselines/algorithm1.h"

#include <algorithm>

#include "lib/baselines/culling.h"

namespace vog {

Algorithm1Map::Algorithm1Map(double voxel_size_m, const SensorModel& model)
    : SubmapMap(voxel_size_m, model), min_(ToLogOdds(model.min)), max_(ToLogOdds(model.max)) {}

Algorithm1Map::Octree Algorithm1Map::ToOctree(const BrickGrid& grid, const Pose3& X_MW) {
  constexpr std::int32_t kKeyOrigin = 32768;
  auto tree = std::make_unique<octomap::OcTree>(grid.grid().voxel_size_m());
  tree->setClampingThresMin(0);  // The model has clamped the values already.
  tree->setClampingThresMax(1);
  grid.ForEach([&](const VoxelKey& key, LogOddsUnits units) {
    const auto index = [](std::int32_t i) {
      return static_cast<octomap::key_type>(i + kKeyOrigin);
    };
    tree->setNodeValue(octomap::OcTreeKey(index(key.x), index(key.y), index(key.z)),
                       ToLogOdds(units),
                       /*lazy_eval=*/true);
  });
  tree->updateInnerOccupancy();
  tree->prune();
  return {std::move(tree), grid.Bounds(), X_MW};
}

void Algorithm1Map::OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) {
  if (after == nullptr) {
    octrees_.erase(id);
  } else if (before != nullptr && before->submap == after->submap) {
    octrees_.at(id).X_MW = after->X_MW;
  } else {
    octrees_[id] = ToOctree(after->submap->grid, after->X_MW);
  }
}

const Algorithm1Map::Octree& Algorithm1Map::OpenOctree() const {
  if (open_octree_.tree == nullptr) open_octree_ = ToOctree(*open(), X_open_W());
  return open_octree_;
}

template <class Extent>
Algorithm1Map::Octrees Algorithm1Map::OctreesIn(const Extent& extent) const {
  Octrees octrees;
  const auto consider = [&](const Octree& octree) {
    if (extent.Touches(octree.box_M, octree.X_MW)) octrees.push_back(&octree);
  };
  for (const auto& [id, octree] : octrees_) consider(octree);
  if (open() != nullptr) consider(OpenOctree());
  return octrees;
}

float Algorithm1Map::LogOddsAt(const Octrees& octrees, const Vec3& p_W) const {
  float sum = 0;
  bool is_known = false;
  for (const Octree* octree : octrees) {
    const Vec3 p_M = octree->X_MW * p_W;
    if (!octree->box_M.contains(p_M)) continue;
    const octomap::OcTreeNode* node = octree->tree->search(p_M.x(), p_M.y(), p_M.z());
    if (node == nullptr) continue;
    sum = std::clamp(sum + node->getLogOdds(), min_, max_);
    is_known = true;
  }
  return is_known ? sum : kUnknownLogOdds;
}

std::vector<double> Algorithm1Map::OccupancyAlong(const Vec3& origin_W, const Vec3& direction_W,
                                                  double step_m, int steps) const {
  const Octrees octrees = OctreesIn(Segment(grid(), origin_W, direction_W, steps * step_m));
  std::vector<double> occupancy;
  for (int k = 1; k <= steps; ++k) {
    const float log_odds = LogOddsAt(octrees, origin_W + k * step_m * direction_W);
    occupancy.push_back(IsKnown(log_odds) ? ProbabilityOfLogOdds(log_odds) : 0.5);
  }
  return occupancy;
}

void Algorithm1Map::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  const Octrees octrees = OctreesIn(Ball(grid(), points_W));
  for (std::size_t i = 0; i < points_W.size(); ++i) log_odds[i] = LogOddsAt(octrees, points_W[i]);
}

void Algorithm1Map::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  const Octrees octrees = OctreesIn(Ball(grid(), voxels));
  ReadVoxels(voxels, log_odds,
             [&](const VoxelKey& voxel) { return LogOddsAt(octrees, grid().CenterOf(voxel)); });
}

void Algorithm1Map::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  const Octrees octrees = OctreesIn(Ball(grid(), box));
  ReadBox(box, log_odds,
          [&](const VoxelKey& voxel) { return LogOddsAt(octrees, grid().CenterOf(voxel)); });
}

void Algorithm1Map::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                            std::vector<RayVoxel>& ray) const {
  const Octrees octrees = OctreesIn(Segment(grid(), origin_W, direction_W, range_m));
  WalkRay(origin_W, direction_W, range_m, ray,
          [&](const VoxelKey& voxel) { return LogOddsAt(octrees, grid().CenterOf(voxel)); });
}

}  // namespace vog
