#include "lib/vogmap/fuse_submaps.h"

#include <memory>
#include <set>
#include <vector>

namespace vog {
namespace {

constexpr std::int32_t kSide = BrickGrid::kBrickSide;

/// A part as it is seen from the fused submap's frame F.
struct Part {
  const BrickGrid* grid;
  Pose3 X_MF;
};

/// Calls `visit(corner)` with the first voxel of each brick.
template <class Visit>
void ForEachBrick(const BrickGrid& grid, Visit visit) {
  const auto& [width, depth, height] = grid.table_size();
  const VoxelKey& origin = grid.table_origin();
  const std::uint16_t* brick = grid.table();
  for (std::uint32_t z = 0; z < height; ++z)
    for (std::uint32_t y = 0; y < depth; ++y)
      for (std::uint32_t x = 0; x < width; ++x) {
        if (*brick++ == BrickGrid::kNoBrick) continue;
        visit(VoxelKey{(origin.x + static_cast<std::int32_t>(x)) * kSide,
                       (origin.y + static_cast<std::int32_t>(y)) * kSide,
                       (origin.z + static_cast<std::int32_t>(z)) * kSide});
      }
}

VoxelKey BrickCornerOf(const VoxelKey& voxel) {
  return {voxel.x & -kSide, voxel.y & -kSide, voxel.z & -kSide};
}

Vec3 MiddleOfBrick(const VoxelGrid& grid, const VoxelKey& corner) {
  return grid.voxel_size_m() * (Vec3(corner.x, corner.y, corner.z) + Vec3::Constant(0.5 * kSide));
}

/// Adds the bricks of F that a brick of `part` may reach.
void AddBricksReached(const Part& part, std::set<VoxelKey>& corners_F) {
  const VoxelGrid& grid = part.grid->grid();
  const Pose3 X_FM = part.X_MF.inverse();
  // Of the box around a turned brick, and a little for rounding.
  const Vec3 half_m =
      (0.5 * kSide + 1e-6) * grid.voxel_size_m() * X_FM.linear().cwiseAbs().rowwise().sum();
  ForEachBrick(*part.grid, [&](const VoxelKey& corner) {
    const Vec3 middle_F = X_FM * MiddleOfBrick(grid, corner);
    const VoxelKey min = BrickCornerOf(grid.KeyOf(middle_F - half_m));
    const VoxelKey max = BrickCornerOf(grid.KeyOf(middle_F + half_m));
    for (std::int32_t z = min.z; z <= max.z; z += kSide)
      for (std::int32_t y = min.y; y <= max.y; y += kSide)
        for (std::int32_t x = min.x; x <= max.x; x += kSide) corners_F.insert({x, y, z});
  });
}

/// The clamped sum of the parts at `p_F`; unknown where none knows it.
LogOddsUnits SumAt(const std::vector<Part>& parts, const Vec3& p_F, const SensorModel& model) {
  int sum = 0;
  bool is_known = false;
  for (const Part& part : parts) {
    const LogOddsUnits units = part.grid->Get(part.grid->grid().KeyOf(part.X_MF * p_F));
    if (units == kUnknownUnits) continue;
    sum += units;
    is_known = true;
  }
  return is_known ? static_cast<LogOddsUnits>(model.Clamp(sum)) : kUnknownUnits;
}

void FillBrick(const std::vector<Part>& parts, const VoxelKey& corner, const SensorModel& model,
               BrickGrid& fused) {
  for (std::int32_t z = 0; z < kSide; ++z)
    for (std::int32_t y = 0; y < kSide; ++y)
      for (std::int32_t x = 0; x < kSide; ++x) {
        const VoxelKey voxel{corner.x + x, corner.y + y, corner.z + z};
        const LogOddsUnits units = SumAt(parts, fused.grid().CenterOf(voxel), model);
        if (units != kUnknownUnits) fused.At(voxel) = units;
      }
}

}  // namespace

SubmapPtr Fuse(const PlacedSubmap& into, std::span<const PlacedSubmap> others,
               const SensorModel& model) {
  std::vector<Part> parts{{&into.submap->grid, Pose3::Identity()}};
  for (const PlacedSubmap& other : others)
    parts.push_back({&other.submap->grid, other.X_MW * into.X_WM});

  std::set<VoxelKey> corners;
  ForEachBrick(into.submap->grid, [&](const VoxelKey& corner) { corners.insert(corner); });
  for (std::size_t i = 1; i < parts.size(); ++i) AddBricksReached(parts[i], corners);

  BrickGrid grid(into.submap->grid.grid().voxel_size_m());
  for (const VoxelKey& corner : corners) FillBrick(parts, corner, model, grid);
  return std::make_shared<Submap>(into.submap->base, into.submap->first_scan,
                                  into.submap->last_scan, into.submap->scans, into.submap->X_ML,
                                  into.submap->drift, std::move(grid));
}

double OverlapOf(const PlacedSubmap& part, const PlacedSubmap& whole) {
  const BrickGrid& grid = part.submap->grid;
  if (grid.bricks() == 0) return 0;
  const Pose3 X_whole_part = whole.X_MW * part.X_WM;
  std::size_t shared = 0;
  ForEachBrick(grid, [&](const VoxelKey& corner) {
    const Vec3 middle = X_whole_part * MiddleOfBrick(grid.grid(), corner);
    shared += whole.submap->grid.HasBrickAt(grid.grid().KeyOf(middle));
  });
  return static_cast<double>(shared) / static_cast<double>(grid.bricks());
}

}  // namespace vog
