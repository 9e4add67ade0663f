#include "lib/vogmap/compact_file.h"

#include "lib/base/errors.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/map_folder_testing.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

class CompactFileTest : public MapFolderTesting {
 protected:
  CompactFileTest() {
    SaveMapFolder(map_, folder_);
    expected_ = LoadMapFolder(folder_, CompactUse::kForbidden).map;
    for (const SubmapPtr& submap : map_.submaps) Age(OctreeNameOf(submap->id()));
  }

  /// Makes a file older than the compact one.
  void Age(const std::string& name) const {
    fs::last_write_time(folder_ / name, fs::last_write_time(file_) - std::chrono::hours(1));
  }

  /// Loads the map, expects all of it to be right, and returns how it was loaded.
  LoadedMap LoadRight() const {
    LoadedMap loaded = LoadMapFolder(folder_);
    EXPECT_TRUE(loaded.faults.empty());
    ExpectSameMaps(loaded.map, expected_);
    return loaded;
  }

  /// The same with other bytes in the compact file, put there at the time of the good ones.
  CompactState StateWith(const std::string& bytes) const {
    const auto time = fs::last_write_time(file_);
    Overwrite(file_, bytes);
    fs::last_write_time(file_, time);
    return LoadRight().compact;
  }

  const fs::path file_ = folder_ / "compact.bin";
  StoredMap expected_;
};

TEST_F(CompactFileTest, GivesTheMapWithoutTheOctrees) {
  const LoadedMap loaded = LoadRight();
  EXPECT_EQ(loaded.compact, CompactState::kValid);
  EXPECT_EQ(loaded.octrees_read, 0u);
}

TEST_F(CompactFileTest, GivesTheSameBytesForTheSameMap) {
  const std::string bytes = ReadFile(file_);
  fs::remove(file_);
  PackMapFolder(folder_);
  EXPECT_TRUE(ReadFile(file_) == bytes);
  EXPECT_EQ(LoadRight().octrees_read, 0u);
  // Though the bricks of this one have other numbers.
  StoredMap again = map_;
  for (SubmapPtr& submap : again.submaps) {
    const VoxelTable table = TableOf(submap->grid);
    Submap shuffled = *submap;
    shuffled.grid = BrickGrid(map_.voxel_size_m);
    shuffled.grid.BrickOf({1000, 1000, 1000});  // A brick without a known voxel.
    for (auto voxel = table.rbegin(); voxel != table.rend(); ++voxel)
      shuffled.grid.At(voxel->first) = static_cast<LogOddsUnits>(voxel->second);
    submap = std::make_shared<Submap>(std::move(shuffled));
  }
  fs::remove(file_);
  SaveMapFolder(again, folder_);
  EXPECT_TRUE(ReadFile(file_) == bytes);
}

TEST_F(CompactFileTest, ItsGridsOutliveItAndMayBeWrittenTo) {
  std::optional<LoadedMap> loaded = LoadMapFolder(folder_);
  ASSERT_EQ(loaded->octrees_read, 0u);
  const SubmapPtr kept = loaded->map.submaps[1];
  loaded.reset();
  fs::remove_all(folder_);
  BrickGrid copy = kept->grid;
  const VoxelTable before = TableOf(kept->grid);
  const auto [key, units] = *before.begin();
  copy.At(key) = static_cast<LogOddsUnits>(units + 1);
  copy.At({500, 0, 0}) = 3;
  EXPECT_TRUE(TableOf(kept->grid) == before);
  VoxelTable after = before;
  after[key] = units + 1;
  after[{500, 0, 0}] = 3;
  EXPECT_TRUE(TableOf(copy) == after);
}

TEST_F(CompactFileTest, OneThatIsMissingOrOfAnotherMapIsNotUsed) {
  const std::string bytes = ReadFile(file_);
  Overwrite(folder_ / "map.toml", ReadFile(folder_ / "map.toml") + "# edited\n");
  LoadedMap loaded = LoadRight();
  EXPECT_EQ(loaded.compact, CompactState::kStale);
  EXPECT_EQ(loaded.octrees_read, 3u);
  fs::remove(file_);
  EXPECT_EQ(LoadRight().compact, CompactState::kMissing);
  fs::create_directory(file_);
  EXPECT_EQ(LoadRight().compact, CompactState::kDamaged);
}

TEST_F(CompactFileTest, OneThatIsCutShortOrTooLongIsNotUsed) {
  const std::string good = ReadFile(file_);
  for (std::size_t size = 0; size < good.size(); size += size < 200 ? 1 : 1 + good.size() / 60)
    EXPECT_EQ(StateWith(good.substr(0, size)), CompactState::kDamaged) << size;
  EXPECT_EQ(StateWith(good + '\0'), CompactState::kDamaged);
  EXPECT_EQ(StateWith(good), CompactState::kValid);
}

TEST_F(CompactFileTest, NoFlippedBitPasses) {
  const std::string good = ReadFile(file_);
  const auto state_with_flipped = [&](std::size_t byte, int bit) {
    std::string damaged = good;
    damaged[byte] = static_cast<char>(damaged[byte] ^ (1 << bit));
    return StateWith(damaged);
  };
  constexpr std::size_t kHeader = 64;
  for (std::size_t byte = 0; byte < kHeader; ++byte)
    EXPECT_NE(state_with_flipped(byte, random_.Index(8)), CompactState::kValid) << byte;
  for (int i = 0; i < 300; ++i) {
    const auto byte = static_cast<std::size_t>(random_.Index(static_cast<int>(good.size())));
    EXPECT_NE(state_with_flipped(byte, random_.Index(8)), CompactState::kValid) << byte;
  }
}

TEST_F(CompactFileTest, DamagedVoxelsCostOneOctree) {
  std::string bytes = ReadFile(file_);
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  EXPECT_EQ(StateWith(bytes), CompactState::kDamaged);
  EXPECT_EQ(LoadRight().octrees_read, 1u);
}

TEST_F(CompactFileTest, AnOctreeThatChangedSinceIsReadItself) {
  const std::string name = "submaps/000001.ot", good = ReadFile(folder_ / name);
  const auto expect_fault = [&] {
    const LoadedMap loaded = LoadMapFolder(folder_);
    EXPECT_EQ(loaded.octrees_read, 1u);
    ASSERT_EQ(loaded.faults.size(), 1u);
    EXPECT_TRUE(loaded.faults[0].starts_with((folder_ / name).string())) << loaded.faults[0];
    EXPECT_EQ(loaded.map.submaps.size(), 2u);
  };
  std::string damaged = good;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  Overwrite(folder_ / name, damaged);
  fs::last_write_time(folder_ / name, fs::last_write_time(file_));  // The same moment.
  expect_fault();
  Overwrite(folder_ / name, good.substr(0, good.size() - 1));
  Age(name);
  expect_fault();
  fs::remove(folder_ / name);
  expect_fault();
  Overwrite(folder_ / name, good);  // Only its time has changed.
  EXPECT_EQ(LoadRight().compact, CompactState::kValid);
}

TEST_F(CompactFileTest, AMapThatGrowsHasNone) {
  map_.complete = false;
  SaveMapFolder(map_, folder_);
  EXPECT_FALSE(fs::exists(file_));
  map_.complete = true;
  SaveMapFolder(map_, folder_);
  EXPECT_TRUE(fs::exists(file_));
}

TEST_F(CompactFileTest, ADamagedMapIsNotPacked) {
  Overwrite(folder_ / "submaps/000001.ot", "damaged");
  EXPECT_THROW(PackMapFolder(folder_), UsageError);
  fs::remove_all(folder_);
  EXPECT_THROW(PackMapFolder(folder_), UsageError);
}

TEST_F(CompactFileTest, MayHoldNoSubmap) {
  StoredMap empty;
  empty.voxel_size_m = 0.2;
  empty.complete = true;
  fs::remove_all(folder_);
  SaveMapFolder(empty, folder_);
  EXPECT_EQ(LoadMapFolder(folder_).compact, CompactState::kValid);
}

TEST_F(CompactFileTest, ASubmapMayKnowNothing) {
  map_.submaps[1] = MakeSubmap(1, BrickGrid(map_.voxel_size_m), random_);
  SaveMapFolder(map_, folder_);
  Age("submaps/000001.ot");
  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_EQ(loaded.octrees_read, 0u);
  EXPECT_EQ(loaded.map.submaps[1]->grid.bricks(), 0u);
}

}  // namespace
}  // namespace vog
