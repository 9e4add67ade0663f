#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "lib/base/files.h"
#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/map_folder.h"

/// Random maps and their folders for tests.
namespace vog {

/// Without flushing to the disk, which makes many small writes slow.
inline void Overwrite(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

inline StoredMap MakeMap(int submaps, Random& random) {
  StoredMap map;
  map.voxel_size_m = 0.095;
  map.sensor_model.hit_probability = 0.65;
  map.run_id = 1234567890123456789;
  map.complete = true;
  for (int id = 0; id < submaps; ++id) {
    map.submaps.push_back(RandomSubmap(id, map.voxel_size_m, random));
    map.X_WM[id] = RandomPose(20, random);
  }
  map.graph_g2o = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n";
  map.end = PlaceInMap{FromUtime(987654321), RandomPose(5, random), 0.25 * Mat3::Identity()};
  if (submaps > 0) map.put_in = map.submaps.back()->base;
  return map;
}

/// All files below a folder, by name.
inline std::map<std::string, std::string> FilesOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[std::filesystem::relative(entry.path(), folder).string()] = ReadFile(entry.path());
  }
  return files;
}

/// Expects two maps to be the same to the last bit; `exactly` false where one of them has not gone
/// through text yet.
inline void ExpectSameMaps(const StoredMap& a, const StoredMap& b, bool exactly = true) {
  const auto same_pose = [&](const Pose3& X, const Pose3& Y) {
    return exactly ? X.matrix() == Y.matrix() : X.isApprox(Y, 1e-14);
  };
  EXPECT_EQ(a.voxel_size_m, b.voxel_size_m);
  EXPECT_EQ(a.sensor_model.hit_probability, b.sensor_model.hit_probability);
  EXPECT_EQ(a.sensor_model.miss_probability, b.sensor_model.miss_probability);
  EXPECT_EQ(a.sensor_model.min_probability, b.sensor_model.min_probability);
  EXPECT_EQ(a.sensor_model.max_probability, b.sensor_model.max_probability);
  EXPECT_EQ(a.sensor_model.occupied_probability, b.sensor_model.occupied_probability);
  EXPECT_EQ(a.run_id, b.run_id);
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.graph_g2o, b.graph_g2o);
  ASSERT_EQ(a.end.has_value(), b.end.has_value());
  if (a.end) {
    EXPECT_EQ(a.end->time, b.end->time);
    EXPECT_TRUE(same_pose(a.end->X_ME, b.end->X_ME));
    EXPECT_EQ(a.end->covariance, b.end->covariance);
  }
  ASSERT_EQ(a.put_in.has_value(), b.put_in.has_value());
  if (a.put_in) {
    EXPECT_EQ(a.put_in->id, b.put_in->id);
    EXPECT_EQ(a.put_in->odometry.time, b.put_in->odometry.time);
    EXPECT_EQ(a.put_in->odometry.origin, b.put_in->odometry.origin);
    EXPECT_EQ(a.put_in->odometry.segment, b.put_in->odometry.segment);
    EXPECT_EQ(a.put_in->odometry.covariance, b.put_in->odometry.covariance);
    EXPECT_TRUE(same_pose(a.put_in->odometry.X_OB, b.put_in->odometry.X_OB));
    EXPECT_TRUE(same_pose(a.put_in->edge.X_PM, b.put_in->edge.X_PM));
    EXPECT_EQ(a.put_in->edge.covariance, b.put_in->edge.covariance);
  }
  ASSERT_EQ(a.submaps.size(), b.submaps.size());
  ASSERT_EQ(a.X_WM.size(), b.X_WM.size());
  for (std::size_t i = 0; i < a.submaps.size(); ++i) {
    const Submap &s = *a.submaps[i], &t = *b.submaps[i];
    ASSERT_EQ(s.id(), t.id());
    EXPECT_EQ(s.scans, t.scans);
    EXPECT_EQ(s.first_scan, t.first_scan);
    EXPECT_EQ(s.last_scan, t.last_scan);
    EXPECT_EQ(s.drift, t.drift);
    EXPECT_EQ(s.base.odometry.time, t.base.odometry.time);
    EXPECT_EQ(s.base.odometry.origin, t.base.odometry.origin);
    EXPECT_EQ(s.base.odometry.segment, t.base.odometry.segment);
    EXPECT_EQ(s.base.odometry.covariance, t.base.odometry.covariance);
    EXPECT_EQ(s.base.edge.covariance, t.base.edge.covariance);
    EXPECT_TRUE(same_pose(s.X_ML, t.X_ML));
    EXPECT_TRUE(same_pose(s.base.odometry.X_OB, t.base.odometry.X_OB));
    EXPECT_TRUE(same_pose(s.base.edge.X_PM, t.base.edge.X_PM));
    EXPECT_TRUE(same_pose(a.X_WM.at(s.id()), b.X_WM.at(s.id())));
    EXPECT_EQ(s.grid.grid().voxel_size_m(), t.grid.grid().voxel_size_m());
    EXPECT_TRUE(TableOf(s.grid) == TableOf(t.grid));
  }
}

/// A test with a folder of its own, gone with it, and a map to put there.
class MapFolderTesting : public testing::Test {
 protected:
  MapFolderTesting() { std::filesystem::remove_all(folder_); }
  ~MapFolderTesting() override { std::filesystem::remove_all(folder_); }

  Random random_{1, "map_folder"};
  StoredMap map_ = MakeMap(3, random_);
  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string(testing::UnitTest::GetInstance()->current_test_info()->test_suite_name()) + "_" +
       testing::UnitTest::GetInstance()->current_test_info()->name());
};

}  // namespace vog
