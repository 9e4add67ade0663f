#include "lib/geometry/trajectory.h"

#include <gtest/gtest.h>

#include <fstream>

#include "lib/base/errors.h"
#include "lib/base/random.h"
#include "lib/geometry/triangle_mesh.h"
#include "lib/geometry/waypoint.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

class TrajectoryTest : public testing::Test {
 protected:
  ~TrajectoryTest() override { fs::remove(path_); }

  std::string ErrorOf(const std::string& text) const {
    std::ofstream(path_) << text;
    try {
      ReadTum(path_);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  }

  Random random_{1, "trajectory"};
  fs::path path_ =
      fs::path(testing::TempDir()) /
      (std::string("trajectory_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(TrajectoryTest, ReadsBackWhatWasWritten) {
  Trajectory trajectory;
  for (int i = 0; i < 500; ++i) {
    const auto utime_us = static_cast<std::int64_t>(random_.Uniform(0, 2e15));
    trajectory.push_back({FromUtime(i == 0 ? -1 : utime_us),
                          MakePose(random_.GaussianVector({100, 1, 1e-9}),
                                   {random_.Uniform(-3, 3), 0.3, random_.Uniform(-3, 3)})});
  }
  WriteTum(path_, trajectory);
  const Trajectory read = ReadTum(path_);
  ASSERT_EQ(read.size(), trajectory.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time, trajectory[i].time);
    EXPECT_EQ(read[i].X_WB.translation(), trajectory[i].X_WB.translation());
    EXPECT_TRUE(read[i].X_WB.linear().isApprox(trajectory[i].X_WB.linear(), 1e-14));
  }
}

TEST_F(TrajectoryTest, PassesOverCommentsAndEmptyLines) {
  EXPECT_EQ(ErrorOf("# time x y z\n\n1.5 1 2 3 0 0 0 1\n"), "no error");
  const Trajectory read = ReadTum(path_);
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(ToUtime(read[0].time), 1'500'000);
  EXPECT_EQ(read[0].X_WB.translation(), Vec3(1, 2, 3));
}

TEST_F(TrajectoryTest, BadLinesAreNamed) {
  for (const char* line :
       {"1 2 3", "1 1 2 3 0 0 0", "1 1 2 3 0 0 0 0", "1 1 2 3 1 1 1 1", "1 1 2 three 0 0 0 1",
        "now 1 2 3 0 0 0 1", "1 nan 2 3 0 0 0 1", "1 1e999 2 3 0 0 0 1", "1e300 1 2 3 0 0 0 1"})
    EXPECT_EQ(ErrorOf("0 0 0 0 0 0 0 1\n" + std::string(line) + "\n"),
              path_.string() + ":2: not a line `t x y z qx qy qz qw`")
        << line;
  EXPECT_THROW(ReadTum(path_.string() + ".none"), SystemError);
}

TEST_F(TrajectoryTest, TheLengthIsThatOfItsSteps) {
  EXPECT_EQ(PathLength({}), 0);
  EXPECT_EQ(PathLength({{Time{}, MakePose({5, 5, 5})}}), 0);
  EXPECT_DOUBLE_EQ(
      PathLength({{{}, MakePose({0, 0, 0})}, {{}, MakePose({3, 4, 0})}, {{}, MakePose({3, 4, 2})}}),
      7);
}

TEST(WaypointTest, TurnsTheShorterWay) {
  const Waypoint a{{0, 0, 0}, 3}, b{{2, 0, 0}, -3};
  const Waypoint half = Interpolate(a, b, 0.5);
  EXPECT_NEAR(std::abs(half.yaw_rad), 3.14159265, 1e-6);
  EXPECT_EQ(half.position_W_m, Vec3(1, 0, 0));
  EXPECT_EQ(LengthOf(a, b), 2);
  EXPECT_NEAR(Interpolate(a, b, 1).yaw_rad, -3, 1e-12);
  EXPECT_NEAR(WaypointOf(a.X_WB()).yaw_rad, a.yaw_rad, 1e-12);
}

TEST(TriangleMeshTest, AppendedTrianglesKeepTheirCorners) {
  TriangleMesh a{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  const TriangleMesh b{{{5, 5, 5}, {6, 5, 5}, {5, 6, 5}}, {{2, 1, 0}}};
  a.Append(b);
  ASSERT_EQ(a.triangles.size(), 2u);
  EXPECT_EQ(a.vertices[a.triangles[1][0]], Vec3(5, 6, 5));
  EXPECT_EQ(a.Bounds().max(), Vec3(6, 6, 5));
  EXPECT_TRUE(TriangleMesh{}.Bounds().isEmpty());
}

}  // namespace
}  // namespace vog
