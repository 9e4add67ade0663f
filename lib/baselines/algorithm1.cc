#include "lib/baselines/algorithm1.h"

#include <algorithm>
#include <numbers>

namespace vog {
namespace {

/// Whether the segment from `origin` along `direction` comes as near as `margin_m` to the box along
/// each axis (slab test).
bool Meets(const Eigen::AlignedBox3d& box, const Vec3& origin, const Vec3& direction,
           double length_m, double margin_m) {
  double enter_m = 0, leave_m = length_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double lo = box.min()[axis] - margin_m - origin[axis];
    const double hi = box.max()[axis] + margin_m - origin[axis];
    if (direction[axis] == 0) {
      if (lo > 0 || hi < 0) return false;
      continue;
    }
    const double a = lo / direction[axis], b = hi / direction[axis];
    enter_m = std::max(enter_m, std::min(a, b));
    leave_m = std::min(leave_m, std::max(a, b));
  }
  return enter_m <= leave_m;
}

std::unique_ptr<octomap::OcTree> ToTree(const BrickGrid& grid) {
  constexpr std::int32_t kKeyOrigin = 32768;
  auto tree = std::make_unique<octomap::OcTree>(grid.grid().voxel_size_m());
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
  return tree;
}

}  // namespace

Algorithm1Map::Algorithm1Map(double voxel_size_m, const SensorModel& model)
    : OccupancyMap(voxel_size_m, ToLogOdds(model.occupied_from)),
      min_(ToLogOdds(model.min)),
      max_(ToLogOdds(model.max)) {}

void Algorithm1Map::Place(const SubmapPtr& submap, const Pose3& X_WM) {
  placed_[submap->id()] = {ToTree(submap->grid), submap->grid.Bounds(), X_WM, X_WM.inverse()};
  ++revision_;
}

std::vector<const Algorithm1Map::Placed*> Algorithm1Map::IntersectingSubmaps(
    const Vec3& origin_W, const Vec3& direction_W, double length_m, double margin_m) const {
  std::vector<const Placed*> submaps;
  for (const auto& [id, placed] : placed_) {
    if (Meets(placed.box_M, placed.X_MW * origin_W, placed.X_MW.linear() * direction_W, length_m,
              margin_m))
      submaps.push_back(&placed);
  }
  return submaps;
}

float Algorithm1Map::LogOddsAt(const std::vector<const Placed*>& submaps, const Vec3& p_W) const {
  float sum = 0;
  bool is_known = false;
  for (const Placed* placed : submaps) {
    const Vec3 p_M = placed->X_MW * p_W;
    if (!placed->box_M.contains(p_M)) continue;
    const octomap::OcTreeNode* node = placed->tree->search(p_M.x(), p_M.y(), p_M.z());
    if (node == nullptr) continue;
    sum = std::clamp(sum + node->getLogOdds(), min_, max_);
    is_known = true;
  }
  return is_known ? sum : kUnknownLogOdds;
}

std::vector<double> Algorithm1Map::OccupancyAlong(const Vec3& origin_W, const Vec3& direction_W,
                                                  double step_m, int steps) const {
  const auto submaps = IntersectingSubmaps(origin_W, direction_W, steps * step_m, 0);
  std::vector<double> occupancy;
  for (int k = 1; k <= steps; ++k) {
    const float log_odds = LogOddsAt(submaps, origin_W + k * step_m * direction_W);
    occupancy.push_back(IsKnown(log_odds) ? ProbabilityOfLogOdds(log_odds) : 0.5);
  }
  return occupancy;
}

std::vector<const Algorithm1Map::Placed*> Algorithm1Map::AllSubmaps() const {
  std::vector<const Placed*> all;
  for (const auto& [id, placed] : placed_) all.push_back(&placed);
  return all;
}

void Algorithm1Map::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  const auto all = AllSubmaps();
  for (std::size_t i = 0; i < points_W.size(); ++i) log_odds[i] = LogOddsAt(all, points_W[i]);
}

void Algorithm1Map::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  ReadVoxels(voxels, log_odds, [this, all = AllSubmaps()](const VoxelKey& voxel) {
    return LogOddsAt(all, grid().CenterOf(voxel));
  });
}

void Algorithm1Map::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  ReadBox(box, log_odds, [this, all = AllSubmaps()](const VoxelKey& voxel) {
    return LogOddsAt(all, grid().CenterOf(voxel));
  });
}

void Algorithm1Map::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                            std::vector<RayVoxel>& ray) const {
  // The answers are at the voxels' centres, which lie beside the ray.
  const double half_diagonal_m = std::numbers::sqrt3 / 2 * grid().voxel_size_m();
  const auto submaps = IntersectingSubmaps(origin_W, direction_W, range_m, half_diagonal_m);
  WalkRay(origin_W, direction_W, range_m, ray,
          [&](const VoxelKey& voxel) { return LogOddsAt(submaps, grid().CenterOf(voxel)); });
}

}  // namespace vog
