#include "lib/submap/brick_grid.h"

#include <algorithm>
#include <stdexcept>

namespace vog {
namespace {

// Bricks added around the table when it grows, so that it seldom does.
constexpr std::int32_t kMargin = 4;
constexpr double kMaxTable = 1u << 26;

}  // namespace

std::optional<BrickGrid> BrickGrid::Borrow(double voxel_size_m, const Parts& parts,
                                           const std::shared_ptr<const void>& lender) {
  static_assert(sizeof(Brick) == kBrickVoxels && alignof(Brick) == 1);
  const auto& [origin, size, table, values] = parts;
  const auto fits = [](std::int32_t first, std::uint32_t count) {
    constexpr std::int64_t kEnd = std::int64_t{1} << (31 - kBrickBits);
    return first >= -kEnd && first + std::int64_t{count} <= kEnd;
  };
  if (double{1} * size[0] * size[1] * size[2] != static_cast<double>(table.size()) ||
      static_cast<double>(table.size()) > kMaxTable || values.size() % kBrickVoxels != 0 ||
      !fits(origin.x, size[0]) || !fits(origin.y, size[1]) || !fits(origin.z, size[2]))
    return std::nullopt;
  const std::size_t bricks = values.size() / kBrickVoxels;
  // Without a branch in the loop, which millions of entries may pass.
  std::size_t strangers = 0;
  for (const std::uint16_t brick : table) strangers += brick >= bricks && brick != kNoBrick;
  if (strangers > 0 || bricks > kNoBrick) return std::nullopt;
  BrickGrid grid(voxel_size_m);
  grid.origin_ = origin;
  grid.size_ = size;
  grid.table_ = {table, lender};
  grid.bricks_ = {{reinterpret_cast<const Brick*>(values.data()), bricks}, lender};
  return grid;
}

void BrickGrid::GrowTo(const VoxelKey& brick) {
  const bool empty = table_.empty();
  const auto end = [&](int axis, std::int32_t origin) {
    return origin + static_cast<std::int32_t>(size_[axis]);
  };
  const auto lower = [&](std::int32_t b, std::int32_t origin) {
    return empty ? b - kMargin : b < origin ? b - kMargin : origin;
  };
  const auto upper = [&](std::int32_t b, std::int32_t last) {
    return empty || b >= last ? b + kMargin + 1 : last;
  };
  const VoxelKey origin{lower(brick.x, origin_.x), lower(brick.y, origin_.y),
                        lower(brick.z, origin_.z)};
  const std::array<std::uint32_t, 3> size = {
      static_cast<std::uint32_t>(upper(brick.x, end(0, origin_.x)) - origin.x),
      static_cast<std::uint32_t>(upper(brick.y, end(1, origin_.y)) - origin.y),
      static_cast<std::uint32_t>(upper(brick.z, end(2, origin_.z)) - origin.z)};
  if (double{1} * size[0] * size[1] * size[2] > kMaxTable)  // In 64 bits it may overflow.
    throw std::length_error("a submap is too large");
  std::vector<std::uint16_t> table(std::size_t{size[0]} * size[1] * size[2], kNoBrick);
  const std::uint32_t dx = origin_.x - origin.x, dy = origin_.y - origin.y,
                      dz = origin_.z - origin.z;
  for (std::uint32_t z = 0; z < size_[2]; ++z)
    for (std::uint32_t y = 0; y < size_[1]; ++y)
      std::copy_n(table_.begin() + (z * size_[1] + y) * size_[0], size_[0],
                  table.begin() + ((z + dz) * size[1] + y + dy) * size[0] + dx);
  origin_ = origin;
  size_ = size;
  table_ = std::move(table);
  is_compact_ = false;
}

std::uint16_t BrickGrid::BrickOf(const VoxelKey& key) {
  const VoxelKey brick{key.x >> kBrickBits, key.y >> kBrickBits, key.z >> kBrickBits};
  const auto outside = [&] {
    return TableCoordinate(key.x, origin_.x) >= size_[0] ||
           TableCoordinate(key.y, origin_.y) >= size_[1] ||
           TableCoordinate(key.z, origin_.z) >= size_[2];
  };
  if (outside()) GrowTo(brick);
  std::uint16_t& number =
      table_[(TableCoordinate(key.z, origin_.z) * size_[1] + TableCoordinate(key.y, origin_.y)) *
                 size_[0] +
             TableCoordinate(key.x, origin_.x)];
  if (number == kNoBrick) {
    if (bricks_.size() == kNoBrick) throw std::length_error("a submap has too many bricks");
    number = static_cast<std::uint16_t>(bricks_.size());
    bricks_.emplace_back().fill(kUnknownUnits);
  }
  return number;
}

LogOddsUnits& BrickGrid::At(const VoxelKey& key) {
  return ValueAt(BrickOf(key), IndexInBrick(key));
}

void BrickGrid::FillInBrick(const VoxelKey& corner, std::int32_t side, LogOddsUnits units) {
  Brick& brick = bricks_[BrickOf(corner)];
  for (std::int32_t z = 0; z < side; ++z)
    for (std::int32_t y = 0; y < side; ++y)
      std::fill_n(brick.begin() + IndexInBrick({corner.x, corner.y + y, corner.z + z}), side,
                  units);
}

Eigen::AlignedBox3d BrickGrid::Bounds() const {
  Eigen::AlignedBox3d bounds;
  const Vec3 half = Vec3::Constant(grid_.voxel_size_m() / 2);
  ForEach([&](const VoxelKey& key, LogOddsUnits) {
    const Vec3 center = grid_.CenterOf(key);
    bounds.extend(center - half);
    bounds.extend(center + half);
  });
  return bounds;
}

bool BrickGrid::HasBrickAt(const VoxelKey& key) const {
  const std::uint32_t x = TableCoordinate(key.x, origin_.x), y = TableCoordinate(key.y, origin_.y),
                      z = TableCoordinate(key.z, origin_.z);
  return x < size_[0] && y < size_[1] && z < size_[2] &&
         table_[(z * size_[1] + y) * size_[0] + x] != kNoBrick;
}

bool BrickGrid::HasBrickIn(const VoxelKey& min, const VoxelKey& max) const {
  const auto first = [&](int axis, std::int32_t voxel, std::int32_t origin) {
    return std::clamp<std::int32_t>((voxel >> kBrickBits) - origin, 0,
                                    static_cast<std::int32_t>(size_[axis]));
  };
  const auto end = [&](int axis, std::int32_t voxel, std::int32_t origin) {
    return std::clamp<std::int32_t>((voxel >> kBrickBits) - origin + 1, 0,
                                    static_cast<std::int32_t>(size_[axis]));
  };
  for (std::int32_t z = first(2, min.z, origin_.z); z < end(2, max.z, origin_.z); ++z)
    for (std::int32_t y = first(1, min.y, origin_.y); y < end(1, max.y, origin_.y); ++y)
      for (std::int32_t x = first(0, min.x, origin_.x); x < end(0, max.x, origin_.x); ++x)
        if (table_[(static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x] != kNoBrick)
          return true;
  return false;
}

void BrickGrid::Compact() {
  const VoxelBounds box = BrickBox();
  if (box.is_empty) {
    *this = BrickGrid(grid_.voxel_size_m());
    return;
  }
  const VoxelKey first = {box.min.x >> kBrickBits, box.min.y >> kBrickBits,
                          box.min.z >> kBrickBits};
  const auto side = [](std::int32_t min, std::int32_t max) {
    return static_cast<std::uint32_t>((max + 1 - min) >> kBrickBits);
  };
  BrickGrid compact(grid_.voxel_size_m());
  compact.origin_ = first;
  compact.size_ = {side(box.min.x, box.max.x), side(box.min.y, box.max.y),
                   side(box.min.z, box.max.z)};
  std::vector<std::uint16_t> table;
  std::vector<Brick> bricks;
  table.reserve(std::size_t{compact.size_[0]} * compact.size_[1] * compact.size_[2]);
  bricks.reserve(bricks_.size());
  const std::uint32_t dx = first.x - origin_.x, dy = first.y - origin_.y, dz = first.z - origin_.z;
  for (std::uint32_t z = 0; z < compact.size_[2]; ++z)
    for (std::uint32_t y = 0; y < compact.size_[1]; ++y)
      for (std::uint32_t x = 0; x < compact.size_[0]; ++x) {
        const std::uint16_t number =
            table_.data()[((z + dz) * size_[1] + y + dy) * size_[0] + x + dx];
        table.push_back(number == kNoBrick ? kNoBrick : static_cast<std::uint16_t>(bricks.size()));
        if (number != kNoBrick) bricks.push_back(bricks_.data()[number]);
      }
  compact.table_ = std::move(table);
  compact.bricks_ = std::move(bricks);
  compact.is_compact_ = true;
  *this = std::move(compact);
}

BrickGrid::VoxelBounds BrickGrid::BrickBox() const {
  VoxelBounds bounds;
  if (is_compact_) {
    const VoxelKey end = CornerOf(size_[0], size_[1], size_[2]);
    return {CornerOf(0, 0, 0), {end.x - 1, end.y - 1, end.z - 1}, false};
  }
  for (std::uint32_t z = 0; z < size_[2]; ++z)
    for (std::uint32_t y = 0; y < size_[1]; ++y)
      for (std::uint32_t x = 0; x < size_[0]; ++x) {
        if (table_[(z * size_[1] + y) * size_[0] + x] == kNoBrick) continue;
        const VoxelKey min = CornerOf(x, y, z);
        const VoxelKey max{min.x + kBrickSide - 1, min.y + kBrickSide - 1, min.z + kBrickSide - 1};
        if (bounds.is_empty) bounds = {min, max, false};
        bounds.min = {std::min(bounds.min.x, min.x), std::min(bounds.min.y, min.y),
                      std::min(bounds.min.z, min.z)};
        bounds.max = {std::max(bounds.max.x, max.x), std::max(bounds.max.y, max.y),
                      std::max(bounds.max.z, max.z)};
      }
  return bounds;
}

Eigen::AlignedBox3d BrickGrid::BrickBounds() const {
  const VoxelBounds box = BrickBox();
  if (box.is_empty) return {};
  const double side_m = grid_.voxel_size_m();
  return {side_m * Vec3(box.min.x, box.min.y, box.min.z),
          side_m * Vec3(box.max.x + 1, box.max.y + 1, box.max.z + 1)};
}

std::size_t BrickGrid::memory_bytes() const {
  return bricks_.capacity() * sizeof(Brick) + table_.capacity() * sizeof(std::uint16_t);
}

}  // namespace vog
