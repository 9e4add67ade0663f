#include "lib/geometry/cloud_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/random.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

std::string PlyHeader(const std::string& format, int points, const std::string& properties) {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex " +
         std::to_string(points) + "\n" + properties + "end_header\n";
}

std::string PcdHeader(const std::string& fields, const std::string& sizes, const std::string& types,
                      int points, const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types +
         "\nPOINTS " + std::to_string(points) + "\nDATA " + data + "\n";
}

constexpr const char* kXyz = "property float x\nproperty float y\nproperty float z\n";

class CloudFileTest : public testing::Test {
 protected:
  CloudFileTest() { fs::create_directories(folder_); }
  ~CloudFileTest() override { fs::remove_all(folder_); }

  fs::path Write(const std::string& name, const std::string& bytes) const {
    fs::remove(folder_ / name);
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  std::vector<Vec3> PointsIn(const std::string& name, const std::string& bytes) const {
    return ReadCloud(Write(name, bytes)).points_V;
  }

  /// Why a file cannot be read, without its name in front.
  std::string FaultOf(const std::string& name, const std::string& bytes) const {
    const fs::path path = Write(name, bytes);
    try {
      ReadCloud(path);
    } catch (const UsageError& error) {
      const std::string what = error.what(), start = path.string() + ": ";
      EXPECT_TRUE(what.starts_with(start)) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
      return what.substr(start.size());
    }
    return "no fault";
  }

  Random random_{1, "cloud_file"};
  fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("cloud_file_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(CloudFileTest, CloudsReadBackAsFloats) {
  for (const char* name : {"a.ply", "a.pcd"}) {
    for (const int count : {0, 1, 1000}) {
      std::vector<Vec3> points;
      for (int i = 0; i < count; ++i) points.push_back(random_.GaussianVector({100, 1, 1e-3}));
      WriteCloud(folder_ / name, points);
      const CloudFile read = ReadCloud(folder_ / name);
      ASSERT_EQ(read.points_V.size(), points.size());
      for (int i = 0; i < count; ++i)
        EXPECT_EQ(read.points_V[i], points[i].cast<float>().cast<double>());
      EXPECT_TRUE(read.X_WV.isApprox(Pose3::Identity(), 0));
    }
  }
}

TEST_F(CloudFileTest, ReadsText) {
  const std::vector<Vec3> points = {{1, 2, 3}, {-4.5, 0.5, 1e-3}};
  EXPECT_EQ(PointsIn("a.ply", PlyHeader("ascii", 2, kXyz) + "1 2 3\n-4.5 .5 1e-3\n"), points);
  EXPECT_EQ(
      PointsIn("a.pcd", PcdHeader("x y z", "4 4 4", "F F F", 2, "ascii") + "1 2 3\n-4.5 .5 1e-3\n"),
      points);
  EXPECT_EQ(PointsIn("a.ply",
                     "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\n"
                     "property float y\r\nproperty float z\r\nend_header\r\n1 2 3\r\n"),
            std::vector<Vec3>{points[0]});
}

TEST_F(CloudFileTest, ReadsTheFieldsOfEveryTypeAndPassesOverTheOthers) {
  const auto bytes_of = [](auto... values) {
    std::string bytes;
    const auto append = [&](auto value) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    (append(values), ...);
    return bytes;
  };
  const std::string ply =
      PlyHeader("binary_little_endian", 1,
                "property uchar red\nproperty double z\nproperty short y\nproperty int x\n") +
      bytes_of(std::uint8_t{9}, 2.5, std::int16_t{-7}, std::int32_t{100000});
  EXPECT_EQ(PointsIn("a.ply", ply), (std::vector<Vec3>{{100000, -7, 2.5}}));
  const std::string pcd = PcdHeader("rgb normal x y z w", "4 4 8 1 2 8",
                                    "U F F I U I\nCOUNT 1 3 1 1 1 1", 1, "binary") +
                          bytes_of(std::uint32_t{1}, 1.f, 2.f, 3.f, 0.125, std::int8_t{-3},
                                   std::uint16_t{65535}, std::int64_t{-1});
  EXPECT_EQ(PointsIn("a.pcd", pcd), (std::vector<Vec3>{{0.125, -3, 65535}}));
  const std::string wide = PcdHeader("x y z", "8 8 8", "I U F", 1, "binary") +
                           bytes_of(std::int64_t{-1} << 40, std::uint64_t{1} << 40, 0.5);
  EXPECT_EQ(PointsIn("a.pcd", wide), (std::vector<Vec3>{{-std::pow(2, 40), std::pow(2, 40), 0.5}}));
}

TEST_F(CloudFileTest, LeavesOutPointsThatAreNotFinite) {
  EXPECT_EQ(PointsIn("a.pcd", PcdHeader("x y z", "4 4 4", "F F F", 3, "ascii") +
                                  "nan nan nan\n1 2 3\ninf 0 0\n"),
            (std::vector<Vec3>{{1, 2, 3}}));
}

TEST_F(CloudFileTest, TheViewpointIsThePose) {
  const std::string header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 0\n";
  const CloudFile read =
      ReadCloud(Write("a.pcd", header + "VIEWPOINT 1 2 3 0 0 0 1\nDATA ascii\n"));
  EXPECT_TRUE(read.X_WV.isApprox(MakePose({1, 2, 3}, Eigen::Quaterniond(0, 0, 0, 1)), 1e-12));
  for (const char* viewpoint : {"1 2 3", "1 2 3 0 0 0 0", "1 2 3 1 1 1 1", "a b c d e f g"})
    EXPECT_EQ(FaultOf("a.pcd", header + "VIEWPOINT " + viewpoint + "\nDATA ascii\n"),
              "VIEWPOINT is not a pose");
}

TEST_F(CloudFileTest, EveryTruncationIsTold) {
  std::vector<Vec3> points(3, Vec3(1, 2, 3));
  for (const char* name : {"a.ply", "a.pcd"}) {
    WriteCloud(folder_ / name, points);
    const std::string bytes = ReadFile(folder_ / name);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_NE(FaultOf(name, bytes.substr(0, size)), "no fault") << name << " " << size;
  }
  EXPECT_EQ(FaultOf("a.ply", PlyHeader("ascii", 2, kXyz) + "1 2 3\n4 5\n"),
            "is cut short: 2 points promised");
}

TEST_F(CloudFileTest, FlippedBitsNeverCrash) {
  std::vector<Vec3> points(5, Vec3(1, 2, 3));
  int told = 0;
  for (const char* name : {"a.ply", "a.pcd"}) {
    WriteCloud(folder_ / name, points);
    const std::string bytes = ReadFile(folder_ / name);
    for (std::size_t i = 0; i < 8 * bytes.size(); i += 3) {
      std::string damaged = bytes;
      damaged[i / 8] ^= 1 << i % 8;
      told += FaultOf(name, damaged) != "no fault";
    }
  }
  EXPECT_GT(told, 100);
}

TEST_F(CloudFileTest, SaysWhatIsWrong) {
  EXPECT_EQ(FaultOf("a.ply", ""), "is not a .ply file");
  EXPECT_EQ(FaultOf("a.pcd", ""), "is not a .pcd file");
  EXPECT_EQ(FaultOf("a.xyz", "1 2 3\n"), "a cloud is a .pcd or a .ply file");
  EXPECT_EQ(FaultOf("a.ply", PlyHeader("binary_big_endian", 0, kXyz)),
            "format binary_big_endian is not read; use ascii or binary_little_endian");
  EXPECT_EQ(FaultOf("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n"), "has no end_header");
  EXPECT_EQ(FaultOf("a.ply", PlyHeader("ascii", 0, "property float x\nproperty float y\n")),
            "has no field z");
  EXPECT_EQ(FaultOf("a.ply", PlyHeader("ascii", 0, "property list uchar int x\n")),
            "has vertices with a list");
  EXPECT_EQ(FaultOf("a.ply", "ply\nformat ascii 1.0\nelement face 1\nproperty int x\nend_header\n"),
            "its first element must be vertex");
  EXPECT_EQ(FaultOf("a.pcd", PcdHeader("x y z", "4 4 4", "F F F", 1, "binary_compressed")),
            "DATA binary_compressed is not read; use ascii or binary");
  EXPECT_EQ(FaultOf("a.ply", PlyHeader("ascii", 1, kXyz) + "1 two 3\n"), "\"two\" is not a number");
  for (const auto& [sizes, types] : {std::pair("4 4 3", "F F F"),
                                     {"4 4 4096", "F F F"},
                                     {"1 4 4", "F F F"},
                                     {"4 2 4", "F F F"},
                                     {"4 4 4", "F F X"},
                                     {"4 4 -4", "F F F"}})
    EXPECT_NE(FaultOf("a.pcd", PcdHeader("x y z", sizes, types, 1, "binary") + "0123456789ab")
                  .find("has an impossible TYPE, SIZE or COUNT"),
              std::string::npos)
        << sizes << " " << types;
  // More fields of more values than 32 bits count.
  std::string fields = "x y z", sizes = "4 4 4", types = "F F F", counts = "1 1 1";
  for (int i = 0; i < 2000; ++i) {
    fields += " a";
    sizes += " 8";
    types += " F";
    counts += " 1000000";
  }
  EXPECT_EQ(FaultOf("a.pcd", PcdHeader(fields, sizes, types + "\nCOUNT " + counts, 1, "binary") +
                                 std::string(5000, 'x')),
            "is cut short: 1 points promised");
  try {
    ReadCloud(folder_ / "none.ply");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_EQ(error.what(), (folder_ / "none.ply").string() + ": no such file");
  }
  EXPECT_THROW(WriteCloud(folder_ / "a.xyz", {}), UsageError);
  EXPECT_THROW(WriteCloud(folder_ / "none" / "a.ply", {}), SystemError);
}

}  // namespace
}  // namespace vog
