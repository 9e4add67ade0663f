#include "lib/submap/brick_grid.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

VoxelKey RandomKey(int half_side, Random& random) {
  const auto index = [&] { return random.Index(2 * half_side) - half_side; };
  const int x = index(), y = index();
  return {x, y, index()};
}

TEST(BrickGridTest, HoldsWhatAnOrdinaryMapHolds) {
  Random random(1, "brick_grid");
  for (const int half_side : {3, 20, 150}) {
    BrickGrid dut(0.1);
    VoxelTable model;
    for (int i = 0; i < 3000; ++i) {
      const VoxelKey key = RandomKey(half_side, random);
      const auto units = static_cast<LogOddsUnits>(random.Index(255) - 127);
      if (random.Chance(0.1)) {
        const int side = 1 << random.Index(4);
        const VoxelKey corner{key.x & -side, key.y & -side, key.z & -side};
        dut.FillInBrick(corner, side, units);
        for (int k = 0; k < side * side * side; ++k)
          model[{corner.x + k % side, corner.y + k / side % side, corner.z + k / side / side}] =
              units;
      } else {
        dut.At(key) = units;
        model[key] = units;
      }
      const VoxelKey asked = RandomKey(2 * half_side, random);
      const auto found = model.find(asked);
      ASSERT_EQ(dut.Get(asked), found == model.end() ? kUnknownUnits : found->second);
      ASSERT_TRUE(found == model.end() || dut.HasBrickAt(asked));
    }
    EXPECT_EQ(TableOf(dut), model);
    EXPECT_GE(dut.memory_bytes(), 512 * dut.bricks());
  }
}

TEST(BrickGridTest, VisitsEachVoxelOnceInAnOrderOfTheContentAlone) {
  Random random(2, "brick_grid");
  const VoxelTable table = RandomTable(500, 30, random);
  std::vector<std::pair<VoxelKey, int>> content(table.begin(), table.end());
  const auto visits = [](const BrickGrid& grid) {
    std::vector<std::pair<VoxelKey, int>> visited;
    grid.ForEach([&](const VoxelKey& key, LogOddsUnits u) { visited.emplace_back(key, u); });
    return visited;
  };
  const auto expected = visits(GridOf(0.1, table));
  EXPECT_EQ(expected.size(), table.size());
  for (int shuffle = 0; shuffle < 5; ++shuffle) {
    BrickGrid dut(0.1);
    for (std::size_t i = content.size(); i > 0; --i) {
      std::swap(content[i - 1], content[random.Index(static_cast<int>(i))]);
      dut.At(content[i - 1].first) = static_cast<LogOddsUnits>(content[i - 1].second);
    }
    EXPECT_EQ(visits(dut), expected);
  }
}

TEST(BrickGridTest, BoundsAreThoseOfTheKnownVoxels) {
  Random random(3, "brick_grid");
  for (int i = 0; i < 20; ++i) {
    const BrickGrid dut = GridOf(0.25, RandomTable(1 + random.Index(20), 40, random));
    Eigen::AlignedBox3d expected;
    for (const auto& [key, units] : TableOf(dut)) {
      expected.extend(0.25 * Vec3(key.x, key.y, key.z));
      expected.extend(0.25 * Vec3(key.x + 1, key.y + 1, key.z + 1));
    }
    EXPECT_TRUE(dut.Bounds().isApprox(expected, 1e-12));
    EXPECT_TRUE(dut.BrickBounds().contains(expected));
    const Eigen::AlignedBox3d seven_more(expected.min() - Vec3::Constant(7 * 0.25),
                                         expected.max() + Vec3::Constant(7 * 0.25));
    EXPECT_TRUE(seven_more.contains(dut.BrickBounds()));
  }
}

TEST(BrickGridTest, AnswersTheSameWhenItIsCompact) {
  Random random(5, "brick_grid");
  for (int i = 0; i < 20; ++i) {
    const BrickGrid before = GridOf(0.1, RandomTable(1 + random.Index(2000), 40, random));
    BrickGrid dut = before;
    dut.Compact();
    EXPECT_EQ(TableOf(dut), TableOf(before));
    EXPECT_EQ(dut.bricks(), before.bricks());
    EXPECT_EQ(dut.grid().voxel_size_m(), 0.1);
    EXPECT_TRUE(dut.Bounds().isApprox(before.Bounds(), 0));
    EXPECT_TRUE(dut.BrickBounds().isApprox(before.BrickBounds(), 0));
    for (int k = 0; k < 1000; ++k) {
      const VoxelKey asked = RandomKey(100, random);
      ASSERT_EQ(dut.Get(asked), before.Get(asked));
      ASSERT_EQ(dut.HasBrickAt(asked), before.HasBrickAt(asked));
    }
    const BrickGrid::VoxelBounds box = dut.BrickBox();
    const std::size_t table_entries = std::size_t(box.max.x + 1 - box.min.x) *
                                      (box.max.y + 1 - box.min.y) * (box.max.z + 1 - box.min.z) /
                                      BrickGrid::kBrickVoxels;
    EXPECT_EQ(dut.memory_bytes(), 512 * dut.bricks() + 2 * table_entries);
    EXPECT_LE(dut.memory_bytes(), before.memory_bytes());
  }
}

TEST(BrickGridTest, GrowsOnAfterItWasCompact) {
  Random random(6, "brick_grid");
  BrickGrid dut(0.1);
  VoxelTable model;
  for (int i = 0; i < 300; ++i) {
    const VoxelKey key = RandomKey(2 + i, random);
    dut.At(key) = 7;
    model[key] = 7;
    if (i % 10 == 0) dut.Compact();
    const BrickGrid rebuilt = GridOf(0.1, model);
    ASSERT_TRUE(dut.BrickBounds().isApprox(rebuilt.BrickBounds(), 0));
  }
  EXPECT_EQ(TableOf(dut), model);
}

TEST(BrickGridTest, CompactsToNothingWithoutBricks) {
  BrickGrid dut(0.1);
  dut.Compact();
  EXPECT_EQ(dut.memory_bytes(), 0u);
  EXPECT_TRUE(dut.BrickBox().is_empty);
  dut.At({1, 2, 3}) = 4;
  EXPECT_EQ(TableOf(dut), (VoxelTable{{{1, 2, 3}, 4}}));
}

TEST(BrickGridTest, IsEmptyAtFirst) {
  const BrickGrid dut(0.1);
  EXPECT_EQ(dut.Get({0, 0, 0}), kUnknownUnits);
  EXPECT_FALSE(dut.HasBrickAt({0, 0, 0}));
  EXPECT_TRUE(dut.Bounds().isEmpty());
  EXPECT_TRUE(dut.BrickBounds().isEmpty());
  EXPECT_TRUE(dut.BrickBox().is_empty);
  EXPECT_EQ(dut.bricks(), 0u);
}

TEST(BrickGridTest, RefusesToGrowBeyondItsLimitsAndKeepsWhatItHas) {
  BrickGrid dut(0.1);
  dut.At({5, 6, 7}) = 42;
  constexpr int kFar = 1 << 30;
  for (const VoxelKey& far :
       {VoxelKey{kFar, kFar, kFar}, VoxelKey{-kFar, kFar, -kFar},
        VoxelKey{1 << 24, 1 << 24, 1 << 25}, VoxelKey{0, kFar, 0},
        // A table of 2^22 x 2^21 x 2^21 bricks, which is 0 in 64 bits.
        VoxelKey{8 * ((1 << 22) - 9), 8 * ((1 << 21) - 9), 8 * ((1 << 21) - 9)}})
    EXPECT_THROW(dut.At(far), std::length_error) << far.x;
  EXPECT_EQ(TableOf(dut), (VoxelTable{{{5, 6, 7}, 42}}));
}

TEST(BrickGridTest, RefusesMoreBricksThanItCanNumber) {
  BrickGrid dut(0.1);
  int made = 0;
  const auto fill = [&] {
    for (int x = 0; x < 256; ++x)
      for (int y = 0; y < 257; ++y, ++made) dut.At({8 * x, 8 * y, 0}) = 1;
  };
  EXPECT_THROW(fill(), std::length_error);
  EXPECT_EQ(made, 65535);
  EXPECT_EQ(TableOf(dut).size(), 65535u);
}

/// The parts of a grid, in memory of their own.
struct Lender {
  explicit Lender(const BrickGrid& grid) {
    const auto size = grid.table_size();
    table.assign(grid.table(), grid.table() + std::size_t{size[0]} * size[1] * size[2]);
    values.assign(grid.values(), grid.values() + grid.bricks() * BrickGrid::kBrickVoxels);
    parts = {grid.table_origin(), size, table, values};
  }
  std::vector<std::uint16_t> table;
  std::vector<LogOddsUnits> values;
  BrickGrid::Parts parts;
};

TEST(BrickGridTest, BorrowsItsPartsUntilItIsWrittenTo) {
  Random random(5, "brick_grid");
  const VoxelTable table = RandomTable(500, 20, random);
  auto lender = std::make_shared<Lender>(GridOf(0.1, table));
  const std::weak_ptr<Lender> alive = lender;
  const auto borrowed = BrickGrid::Borrow(0.1, lender->parts, lender);
  ASSERT_TRUE(borrowed);
  EXPECT_EQ(borrowed->table(), lender->table.data());
  EXPECT_EQ(borrowed->values(), lender->values.data());
  EXPECT_EQ(TableOf(*borrowed), table);
  lender.reset();
  std::optional<BrickGrid> copy = *borrowed, grown = *borrowed;
  const BrickGrid moved = std::move(*copy);
  EXPECT_EQ(TableOf(moved), table);
  EXPECT_EQ(copy->bricks(), 0u);
  grown->At({1000, 0, 0}) = 5;
  grown->FillInBrick({0, 0, 0}, 8, 7);
  EXPECT_NE(grown->values(), borrowed->values());
  EXPECT_EQ(grown->Get({1000, 0, 0}), 5);
  EXPECT_EQ(grown->Get({3, 4, 5}), 7);
  EXPECT_EQ(TableOf(*borrowed), table);
  const BrickGrid own = *grown;
  grown->At({3, 4, 5}) = 8;
  EXPECT_EQ(own.Get({3, 4, 5}), 7);
  EXPECT_FALSE(alive.expired());
}

TEST(BrickGridTest, BorrowsNothingThatWouldLeadOutside) {
  Random random(6, "brick_grid");
  const auto good = std::make_shared<Lender>(GridOf(0.1, RandomTable(100, 10, random)));
  const auto borrows = [](const std::shared_ptr<Lender>& lender, const BrickGrid::Parts& parts) {
    return BrickGrid::Borrow(0.1, parts, lender).has_value();
  };
  EXPECT_TRUE(borrows(good, good->parts));
  BrickGrid::Parts parts = good->parts;
  parts.size[0] += 1;
  EXPECT_FALSE(borrows(good, parts));
  parts.size = {1u << 31, 1u << 31, 4};
  EXPECT_FALSE(borrows(good, parts));
  parts = good->parts;
  parts.values = parts.values.first(parts.values.size() - 1);
  EXPECT_FALSE(borrows(good, parts));
  parts = good->parts;
  parts.origin.y = std::numeric_limits<std::int32_t>::min();
  EXPECT_FALSE(borrows(good, parts));
  for (std::uint16_t& entry : good->table) {
    const std::uint16_t before = entry;
    entry = static_cast<std::uint16_t>(good->values.size() / BrickGrid::kBrickVoxels);
    EXPECT_FALSE(borrows(good, good->parts));
    entry = before;
  }
}

TEST(OccupiedPointsTest, LeavesOutTheFreeAndTheLonely) {
  Random random(4, "brick_grid");
  const VoxelTable table = RandomTable(3000, 8, random);
  const BrickGrid grid = GridOf(0.1, table);
  const auto is_occupied = [&](const VoxelKey& key) {
    const auto found = table.find(key);
    return found != table.end() && found->second >= 10;
  };
  for (const int min_neighbours : {0, 3, 8, 27}) {
    std::size_t expected = 0;
    for (const auto& [key, units] : table) {
      int neighbours = 0;
      for (int i = 0; i < 27; ++i)
        if (i != 13)
          neighbours += is_occupied({key.x + i % 3 - 1, key.y + i / 3 % 3 - 1, key.z + i / 9 - 1});
      expected += is_occupied(key) && neighbours >= min_neighbours;
    }
    const std::vector<Vec3> points = OccupiedPoints(grid, 10, min_neighbours);
    EXPECT_EQ(points.size(), expected);
    EXPECT_EQ(points.empty(), min_neighbours == 27);
    for (const Vec3& p : points) EXPECT_TRUE(is_occupied(grid.grid().KeyOf(p)));
  }
}

}  // namespace
}  // namespace vog
