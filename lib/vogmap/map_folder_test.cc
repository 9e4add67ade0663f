#include "lib/vogmap/map_folder.h"

#include <gtest/gtest.h>

#include "lib/base/errors.h"
#include "lib/base/parallel.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/map_folder_testing.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

class MapFolderTest : public MapFolderTesting {
 protected:
  std::string ErrorOfLoading() const {
    try {
      LoadMapFolder(folder_);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  }

  /// The one fault of a map whose file `name` holds `bytes`.
  std::string FaultWith(const std::string& name, const std::string& bytes) const {
    Overwrite(folder_ / name, bytes);
    const LoadedMap loaded = LoadMapFolder(folder_);
    EXPECT_EQ(loaded.faults.size(), 1u) << name;
    EXPECT_EQ(loaded.map.submaps.size(), map_.submaps.size() - (name != "graph.g2o"));
    return loaded.faults.empty() ? "no fault" : loaded.faults[0];
  }

  /// map.toml with the first `from` replaced by `to`.
  void Edit(const std::string& from, const std::string& to) const {
    std::string text = ReadFile(folder_ / "map.toml");
    ASSERT_NE(text.find(from), std::string::npos) << from;
    Overwrite(folder_ / "map.toml", text.replace(text.find(from), from.size(), to));
  }
};

TEST_F(MapFolderTest, ReadsBackWhatWasSaved) {
  SaveMapFolder(map_, folder_);
  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_TRUE(loaded.faults.empty());
  ExpectSameMaps(loaded.map, map_, /*exactly=*/false);
}

TEST_F(MapFolderTest, SavingALoadedMapGivesTheSameBytes) {
  // Quaternions of these survive their way through a rotation matrix to the last digit.
  for (auto& [id, X_WM] : map_.X_WM) X_WM = MakePose(RandomPoint(20, random_));
  for (SubmapPtr& submap : map_.submaps) {
    Submap plain = *submap;
    plain.base.odometry.X_OB = MakePose(RandomPoint(20, random_));
    plain.X_ML = MakePose(RandomPoint(1, random_));
    plain.base.edge.X_PM = MakePose(RandomPoint(1, random_), Eigen::Quaterniond(0, 0, 0, 1));
    submap = std::make_shared<Submap>(plain);
  }
  map_.end->X_ME = MakePose(RandomPoint(5, random_));
  map_.put_in = map_.submaps.back()->base;
  SaveMapFolder(map_, folder_);
  const auto files = FilesOf(folder_);
  EXPECT_EQ(files.size(), 6u);
  SaveMapFolder(LoadMapFolder(folder_).map, folder_);
  EXPECT_TRUE(FilesOf(folder_) == files);
}

TEST_F(MapFolderTest, MayHoldNoSubmap) {
  StoredMap empty;
  empty.voxel_size_m = 0.2;
  SaveMapFolder(empty, folder_);
  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_TRUE(loaded.map.submaps.empty());
  EXPECT_TRUE(loaded.faults.empty());
  EXPECT_FALSE(loaded.map.complete);
}

TEST_F(MapFolderTest, NumbersThatLookLikeIntegersReadBack) {
  for (double& number : map_.X_WM[0].translation()) number = 1e22;
  map_.X_WM[1] = MakePose({1, -2, 300000});
  SaveMapFolder(map_, folder_);
  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_EQ(loaded.map.X_WM.at(0).translation(), Vec3::Constant(1e22));
  EXPECT_EQ(loaded.map.X_WM.at(1).translation(), Vec3(1, -2, 300000));
}

TEST_F(MapFolderTest, NeedNotTellOfAnEndNorOfEarlierFlights) {
  map_.end.reset();
  map_.put_in.reset();
  for (const bool is_complete : {false, true}) {  // From octrees, and from the compact file.
    map_.complete = is_complete;
    SaveMapFolder(map_, folder_);
    ExpectSameMaps(LoadMapFolder(folder_).map, map_, /*exactly=*/false);
  }
  EXPECT_EQ(ReadFile(folder_ / "map.toml").find("[end]"), std::string::npos);
  EXPECT_EQ(ReadFile(folder_ / "map.toml").find("[put_in]"), std::string::npos);
}

TEST_F(MapFolderTest, AnEndThatMakesNoSenseIsTheMapsFault) {
  SaveMapFolder(map_, folder_);
  const std::string whole = ReadFile(folder_ / "map.toml");
  for (const auto& [from, to, key] :
       {std::array<std::string, 3>{"X_ME = [", "X_ME = [7.5, ", "X_ME"},
        {"[end]\nutime_us = 987654321", "[end]\nutime_us = \"now\"", "utime_us"},
        {"[put_in]\nid = 2", "[put_in]\nid = -2", "id"}}) {
    Overwrite(folder_ / "map.toml", whole);
    Edit(from, to);
    EXPECT_NE(ErrorOfLoading().find(": " + key + " is missing or makes no sense"),
              std::string::npos)
        << ErrorOfLoading();
  }
}

TEST_F(MapFolderTest, LeavesOutADamagedSubmapAndNamesIt) {
  SaveMapFolder(map_, folder_);
  const std::string name = "submaps/000001.ot", path = (folder_ / name).string();
  const std::string good = ReadFile(path);
  for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 40)
    EXPECT_TRUE(FaultWith(name, good.substr(0, size)).starts_with(path + ": ")) << size;
  for (int i = 0; i < 40; ++i) {
    std::string damaged = good;
    damaged[random_.Index(static_cast<int>(good.size()))] ^= 1 << random_.Index(8);
    const std::string fault = FaultWith(name, damaged);
    EXPECT_TRUE(fault.starts_with(path + ": ")) << fault;
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
  }
  fs::remove(path);
  const LoadedMap loaded = LoadMapFolder(folder_);
  ASSERT_EQ(loaded.faults.size(), 1u);
  EXPECT_TRUE(loaded.faults[0].starts_with(path + ": cannot read")) << loaded.faults[0];
  ASSERT_EQ(loaded.map.submaps.size(), 2u);
  EXPECT_EQ(loaded.map.submaps[1]->id(), 2);
}

TEST_F(MapFolderTest, KeepsTheSubmapsWhenTheGraphIsDamaged) {
  SaveMapFolder(map_, folder_);
  EXPECT_TRUE(FaultWith("graph.g2o", "other").starts_with((folder_ / "graph.g2o").string()));
  fs::remove(folder_ / "graph.g2o");
  EXPECT_EQ(LoadMapFolder(folder_).faults.size(), 1u);
}

TEST_F(MapFolderTest, ACrashBeforeTheCommitLeavesTheMapOfBefore) {
  SaveMapFolder(map_, folder_);
  const std::string before = ReadFile(folder_ / "map.toml");
  // What a process leaves that was killed while it wrote the next submap and the new map.toml.
  MapFolderWriter writer(folder_);
  for (const SubmapPtr& submap : map_.submaps)
    writer.AddSubmap(*submap, ToOctreeBytes(submap->grid));
  const SubmapPtr next = RandomSubmap(3, map_.voxel_size_m, random_);
  writer.AddSubmap(*next, ToOctreeBytes(next->grid));
  Overwrite(folder_ / "submaps/000004.ot.tmp", "half a subm");
  Overwrite(folder_ / "map.toml.tmp", before.substr(0, before.size() / 2));

  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_TRUE(loaded.faults.empty());
  EXPECT_EQ(loaded.map.submaps.size(), 3u);

  map_.submaps.push_back(next);
  map_.X_WM[3] = Pose3::Identity();
  writer.Commit(map_);
  EXPECT_EQ(LoadMapFolder(folder_).map.submaps.size(), 4u);
}

TEST_F(MapFolderTest, ADamagedCheckSumCostsOneSubmap) {
  SaveMapFolder(map_, folder_);
  const std::string good = ReadFile(folder_ / "map.toml");
  for (const char* sum : {"0000000g", "0", "123456789", "00000000"}) {
    Overwrite(folder_ / "map.toml", good);
    Edit("\ncrc32 = \"", "\ncrc32 = \"" + std::string(sum) + "\" # ");
    const LoadedMap loaded = LoadMapFolder(folder_);
    EXPECT_EQ(loaded.map.submaps.size(), 2u) << sum;
    EXPECT_EQ(loaded.faults.size(), 1u) << sum;
  }
}

TEST_F(MapFolderTest, AnotherMapReplacesTheOneThereAsAWhole) {
  SaveMapFolder(map_, folder_);
  const StoredMap before = LoadMapFolder(folder_).map;
  StoredMap other = MakeMap(5, random_);
  other.graph_g2o = "VERTEX_SE3:QUAT 0 1 0 0 0 0 0 1\n";
  const fs::path elsewhere = folder_.string() + "_elsewhere";
  SaveMapFolder(other, elsewhere);
  const auto expected = FilesOf(elsewhere);

  // Killed before map.toml is there: the old map, with all its files.
  {
    MapFolderWriter killed(folder_);
    for (const SubmapPtr& submap : other.submaps)
      killed.AddSubmap(*submap, ToOctreeBytes(submap->grid));
    LoadedMap loaded = LoadMapFolder(folder_);
    EXPECT_TRUE(loaded.faults.empty());
    ExpectSameMaps(loaded.map, before);
    Overwrite(folder_ / ("graph-" + ToHex(Crc32(other.graph_g2o)) + ".g2o"), other.graph_g2o);
    Overwrite(folder_ / "compact.bin.tmp", "half a comp");
    loaded = LoadMapFolder(folder_);
    EXPECT_TRUE(loaded.faults.empty());
    ExpectSameMaps(loaded.map, before);
  }
  // Killed after it: the new one, though its files are not in place yet.
  Overwrite(folder_ / "map.toml", expected.at("map.toml"));
  const LoadedMap loaded = LoadMapFolder(folder_);
  EXPECT_TRUE(loaded.faults.empty());
  EXPECT_EQ(loaded.compact, CompactState::kStale);
  ExpectSameMaps(loaded.map, LoadMapFolder(elsewhere).map);

  // The next one who writes tidies up. Nothing tells what was there before.
  SaveMapFolder(other, folder_);
  EXPECT_TRUE(FilesOf(folder_) == expected);
  fs::remove_all(elsewhere);
}

TEST_F(MapFolderTest, OnlyWhatHasChangedIsWritten) {
  SaveMapFolder(map_, folder_);
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  const auto age = [&] {
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file()) fs::last_write_time(entry.path(), old);
  };
  const auto written = [&] {
    std::vector<std::string> names;
    for (const auto& [name, bytes] : FilesOf(folder_))
      if (fs::last_write_time(folder_ / name) > old + std::chrono::minutes(1))
        names.push_back(name);
    return names;
  };
  age();
  SaveMapFolder(map_, folder_);
  EXPECT_EQ(written(), std::vector<std::string>{});

  map_.submaps.push_back(RandomSubmap(3, map_.voxel_size_m, random_));
  map_.X_WM[3] = Pose3::Identity();
  SaveMapFolder(map_, folder_);
  EXPECT_EQ(written(), (std::vector<std::string>{"compact.bin", "map.toml", "submaps/000003.ot"}));
}

TEST_F(MapFolderTest, LoadsTheSameWithAnyNumberOfThreads) {
  map_ = MakeMap(12, random_);
  SaveMapFolder(map_, folder_);
  for (const char* name : {"submaps/000003.ot", "submaps/000007.ot", "submaps/000008.ot"})
    Overwrite(folder_ / name, "damaged");
  for (const CompactUse use : {CompactUse::kAllowed, CompactUse::kForbidden}) {
    SetParallelThreads(1);
    const LoadedMap one = LoadMapFolder(folder_, use);
    SetParallelThreads(4);
    const LoadedMap four = LoadMapFolder(folder_, use);
    SetParallelThreads(0);
    EXPECT_EQ(one.faults.size(), 3u);
    EXPECT_EQ(one.faults, four.faults);
    ExpectSameMaps(one.map, four.map);
  }
}

TEST_F(MapFolderTest, FailsWhereNothingCanBeWritten) {
  Overwrite(folder_, "a file, not a folder");
  EXPECT_THROW(SaveMapFolder(map_, folder_), SystemError);
  EXPECT_EQ(ReadFile(folder_), "a file, not a folder");
}

TEST_F(MapFolderTest, SaysWhatIsWrongWithAMap) {
  const std::string file = (folder_ / "map.toml").string();
  EXPECT_EQ(ErrorOfLoading(),
            folder_.string() + ": no map here: a map is a folder with a map.toml");
  EXPECT_FALSE(IsMapFolder(folder_));
  fs::create_directories(folder_);
  Overwrite(file, "format = 2\nrun_id == 3\n");
  EXPECT_TRUE(ErrorOfLoading().starts_with(file + ":2: ")) << ErrorOfLoading();
  Overwrite(file, "");
  EXPECT_TRUE(ErrorOfLoading().starts_with(file + ":")) << ErrorOfLoading();

  const std::vector<std::pair<std::string, std::string>> edits = {
      {"format = 2", "format = 3"},
      {"voxel_size_m = 0.095", "voxel_size_m = \"wide\""},
      {"voxel_size_m = 0.095", "voxel_size_m = -0.095"},
      {"voxel_size_m = 0.095", "voxel_size_m = nan"},
      {"[sensor_model]", "[sensor_modle]"},
      {"hit_probability", "hit_probably"},
      {"hit_probability = 0.65", "hit_probability = 7.0"},
      {"X_WM = [", "X_WM = [1.0, "},
      {"X_WM = [", "X_WM = [nan, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] # "},
      {"X_WM = [", "X_WM = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0] # "},
      {"drift = [", "drift = 5 # "},
      {"scans = 10", "scans = \"ten\""},
      {"graph_crc32", "graph_crc"},
      {"id = 1\n", "id = 0\n"},
      {"id = 0\n", "id = -1\n"}};
  SaveMapFolder(map_, folder_);
  const std::string good = ReadFile(file);
  for (const auto& [from, to] : edits) {
    Overwrite(file, good);
    Edit(from, to);
    const std::string error = ErrorOfLoading();
    EXPECT_TRUE(error.starts_with(file + ":")) << from << " -> " << to << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST_F(MapFolderTest, ADamagedMapTomlNeverCrashes) {
  SaveMapFolder(map_, folder_);
  const std::string good = ReadFile(folder_ / "map.toml");
  const auto load = [&](const std::string& text) {
    Overwrite(folder_ / "map.toml", text);
    try {
      EXPECT_LE(LoadMapFolder(folder_).map.submaps.size(), 3u);
    } catch (const UsageError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with((folder_ / "map.toml").string()))
          << error.what();
    }
  };
  for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 100)
    load(good.substr(0, size));
  for (int i = 0; i < 100; ++i) {
    std::string damaged = good;
    damaged[random_.Index(static_cast<int>(good.size()))] ^= 1 << random_.Index(8);
    load(damaged);
  }
}

}  // namespace
}  // namespace vog
