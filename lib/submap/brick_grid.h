#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "lib/geometry/voxel_grid.h"
#include "lib/submap/lendable_vector.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// Log-odds of voxels, in units, in bricks of 8 x 8 x 8: a table over the box of all bricks holds
/// each brick's number, so that a look-up costs two loads. Memory: 512 bytes a brick and 2 a table
/// entry.
class BrickGrid {
 public:
  static constexpr int kBrickBits = 3;
  static constexpr std::int32_t kBrickSide = 1 << kBrickBits;
  static constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;
  /// What the table says of a brick that was never written to.
  static constexpr std::uint16_t kNoBrick = 0xffff;

  explicit BrickGrid(double voxel_size_m) : grid_(voxel_size_m) {}

  /// A table over `size` bricks from `origin` on (in bricks), x fastest, and the bricks' voxels.
  struct Parts {
    VoxelKey origin;
    std::array<std::uint32_t, 3> size = {0, 0, 0};
    std::span<const std::uint16_t> table;
    std::span<const LogOddsUnits> values;
  };
  /// A grid that reads `parts` where they lie, kept alive by `lender`; it copies them when it is
  /// first written to. Nothing when they do not fit together: a table of another size, or one that
  /// names a brick that is not there.
  static std::optional<BrickGrid> Borrow(double voxel_size_m, const Parts& parts,
                                         const std::shared_ptr<const void>& lender);

  const VoxelGrid& grid() const { return grid_; }

  /// kUnknownUnits where nothing was ever written.
  LogOddsUnits Get(const VoxelKey& key) const {
    const std::uint32_t x = TableCoordinate(key.x, origin_.x),
                        y = TableCoordinate(key.y, origin_.y),
                        z = TableCoordinate(key.z, origin_.z);
    if (x >= size_[0] || y >= size_[1] || z >= size_[2]) return kUnknownUnits;
    const std::uint16_t brick = table_[(z * size_[1] + y) * size_[0] + x];
    return brick == kNoBrick ? kUnknownUnits : bricks_[brick][IndexInBrick(key)];
  }

  /// The voxel's place, for reading and writing; its brick is made if need be. The address lives
  /// until the next call. @throws std::length_error past 65,535 bricks or a table of 2^26 entries.
  LogOddsUnits& At(const VoxelKey& key);

  /// Writes a cube of `side` voxels from `corner` on. @pre it lies in one brick.
  void FillInBrick(const VoxelKey& corner, std::int32_t side, LogOddsUnits units);

  /// The number of the brick that holds `key`, made if need be. Numbers stay; see ValueAt().
  std::uint16_t BrickOf(const VoxelKey& key);
  LogOddsUnits& ValueAt(std::uint16_t brick, int index) { return bricks_[brick][index]; }
  static int IndexInBrick(const VoxelKey& key) {
    constexpr int kMask = kBrickSide - 1;
    return (key.z & kMask) << (2 * kBrickBits) | (key.y & kMask) << kBrickBits | (key.x & kMask);
  }

  /// Calls `visit(key, units)` for each known voxel, in an order that depends on the content alone.
  template <class Visit>
  void ForEach(Visit visit) const {
    for (std::uint32_t z = 0; z < size_[2]; ++z)
      for (std::uint32_t y = 0; y < size_[1]; ++y)
        for (std::uint32_t x = 0; x < size_[0]; ++x)
          VisitBrick(table_[(z * size_[1] + y) * size_[0] + x], CornerOf(x, y, z), visit);
  }

  /// Whether the brick that holds `key` was ever written to.
  bool HasBrickAt(const VoxelKey& key) const;
  /// Whether some brick meets the box of voxels, both ends included.
  bool HasBrickIn(const VoxelKey& min, const VoxelKey& max) const;

  /// The voxels that bricks span, both ends included.
  struct VoxelBounds {
    VoxelKey min, max;
    bool is_empty = true;
  };
  VoxelBounds BrickBox() const;

  /// The box of all known voxels in the grid's own frame, empty without any. Costs a pass over all.
  Eigen::AlignedBox3d Bounds() const;

  /// A box that holds all bricks, in the grid's own frame; a little larger than Bounds(). Costs a
  /// pass over the table, or nothing after Compact().
  Eigen::AlignedBox3d BrickBounds() const;

  /// Makes the grid as small as its content: a table of the bricks' box alone, bricks in its order.
  /// Answers stay as they are; numbers of bricks do not.
  void Compact();

  std::size_t bricks() const { return bricks_.size(); }

  /// The bare storage, for those who read many grids at once. A table over table_size() bricks from
  /// table_origin() on (in bricks), x fastest, then y, of brick numbers or kNoBrick; values of
  /// brick n from n * kBrickVoxels on, see IndexInBrick(). They live until the grid is changed.
  const std::uint16_t* table() const { return table_.data(); }
  const LogOddsUnits* values() const { return bricks_.empty() ? nullptr : bricks_.data()->data(); }
  const VoxelKey& table_origin() const { return origin_; }
  const std::array<std::uint32_t, 3>& table_size() const { return size_; }
  std::size_t memory_bytes() const;

 private:
  using Brick = std::array<LogOddsUnits, kBrickVoxels>;

  static std::uint32_t TableCoordinate(std::int32_t index, std::int32_t origin) {
    return static_cast<std::uint32_t>((index >> kBrickBits) - origin);
  }
  VoxelKey CornerOf(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return {(origin_.x + static_cast<std::int32_t>(x)) * kBrickSide,
            (origin_.y + static_cast<std::int32_t>(y)) * kBrickSide,
            (origin_.z + static_cast<std::int32_t>(z)) * kBrickSide};
  }
  template <class Visit>
  void VisitBrick(std::uint16_t number, const VoxelKey& corner, Visit& visit) const {
    if (number == kNoBrick) return;
    const Brick& brick = bricks_[number];
    int i = 0;
    for (int z = 0; z < kBrickSide; ++z)
      for (int y = 0; y < kBrickSide; ++y)
        for (int x = 0; x < kBrickSide; ++x, ++i)
          if (brick[i] != kUnknownUnits)
            visit(VoxelKey{corner.x + x, corner.y + y, corner.z + z}, brick[i]);
  }
  void GrowTo(const VoxelKey& brick_coordinates);

  VoxelGrid grid_;
  VoxelKey origin_;                                // First brick of the table, in bricks.
  std::array<std::uint32_t, 3> size_ = {0, 0, 0};  // Of the table, in bricks.
  LendableVector<std::uint16_t> table_;
  LendableVector<Brick> bricks_;
  bool is_compact_ = false;  // The table is the bricks' box.
};

}  // namespace vog
