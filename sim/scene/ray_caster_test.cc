#include "sim/scene/ray_caster.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "lib/base/parallel.h"
#include "lib/base/random.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kTolerance_m = 1e-5;

TriangleMesh UnitBox() { return Box(Pose3::Identity(), {1, 1, 1}); }

TEST(RayCasterTest, MeetsABoxWhereItStands) {
  const RayCaster caster(UnitBox());
  const auto hit = caster.Cast({-3, 0.1, 0.2}, Vec3::UnitX(), 10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range_m, 2.5, kTolerance_m);
  EXPECT_TRUE(hit->normal_W.isApprox(-Vec3::UnitX(), 1e-6));
}

TEST(RayCasterTest, MeetsASlantedFace) {
  const Pose3 X_WA = MakePose({2, 1, 0}, {0, 0, std::numbers::pi / 4});
  const RayCaster caster(Box(X_WA, {2, 2, 2}));
  const auto hit = caster.Cast({0, 1.2, 0}, Vec3::UnitX(), 10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range_m, 2 - std::sqrt(2.0) + 0.2, kTolerance_m);
  EXPECT_TRUE(hit->normal_W.isApprox(Vec3(-1, 1, 0).normalized(), 1e-6));
}

TEST(RayCasterTest, SeesNothingBeyondTheRangeOrBehind) {
  const RayCaster caster(UnitBox());
  EXPECT_FALSE(caster.Cast({-3, 0, 0}, Vec3::UnitX(), 2.4));
  EXPECT_TRUE(caster.Cast({-3, 0, 0}, Vec3::UnitX(), 2.6));
  EXPECT_FALSE(caster.Cast({-3, 0, 0}, -Vec3::UnitX(), 10));
}

TEST(RayCasterTest, MeetsBothSidesAndTellsTheTriangle) {
  const TriangleMesh mesh = UnitBox();
  const RayCaster caster(mesh);
  const auto hit = caster.Cast({0.1, 0.2, 0}, Vec3::UnitZ(), 10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range_m, 0.5, kTolerance_m);
  EXPECT_TRUE(hit->normal_W.isApprox(Vec3::UnitZ(), 1e-6)) << "as wound: outward";
  for (const std::uint32_t corner : mesh.triangles.at(hit->triangle))
    EXPECT_NEAR(mesh.vertices[corner].z(), 0.5, 1e-12);
}

TEST(RayCasterTest, LetsNothingThroughTheEdgesBetweenTriangles) {
  const RayCaster caster(Refine(UnitBox(), 0.1));
  for (int i = 0; i <= 200; ++i) {
    const Vec3 target(-0.5, 0.499 * (i / 100.0 - 1), 0.499 * (i / 100.0 - 1));
    EXPECT_TRUE(caster.Cast({-3, 0, 0}, (target - Vec3(-3, 0, 0)).normalized(), 10)) << i;
  }
}

TEST(RayCasterTest, StaysExactFarFromTheOrigin) {
  const Vec3 far(500000, -300000, 100);
  const RayCaster caster(Box(MakePose(far), {1, 1, 1}));
  const auto hit = caster.Cast(far - Vec3(3, 0.1, 0.2), Vec3::UnitX(), 10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range_m, 2.5, kTolerance_m);
}

TEST(RayCasterTest, TellsWhatIsOccluded) {
  const RayCaster caster(UnitBox());
  EXPECT_TRUE(caster.Occluded({-2, 0, 0}, {2, 0, 0}));
  EXPECT_FALSE(caster.Occluded({-2, 0, 0}, {-1, 0, 0}));
  EXPECT_FALSE(caster.Occluded({-2, 0, 2}, {2, 0, 2}));
  EXPECT_FALSE(caster.Occluded({-2, 0.1, 0.2}, {-0.5, 0.1, 0.2})) << "up to the surface itself";
  EXPECT_TRUE(caster.Occluded({-2, 0.1, 0.2}, {0.5, 0.1, 0.2})) << "to the far side";
  EXPECT_FALSE(caster.Occluded({0, 0, 0}, {0, 0, 0}));
}

TEST(RayCasterTest, TellsInsideFromOutside) {
  const RayCaster caster(UnitBox());
  Random random(1, "test");
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    EXPECT_EQ(caster.Inside(p), p.cwiseAbs().maxCoeff() < 0.5) << p.transpose();
  }
}

TEST(RayCasterTest, InsideOfOverlappingSolidsIsInside) {
  TriangleMesh mesh = UnitBox();
  mesh.Append(Box(MakePose({0.5, 0, 0}), {1, 1, 1}));
  const RayCaster caster(mesh);
  EXPECT_TRUE(caster.Inside({-0.25, 0.1, 0.1}));
  EXPECT_TRUE(caster.Inside({0.25, 0.1, 0.1})) << "in both";
  EXPECT_TRUE(caster.Inside({0.75, 0.1, 0.1}));
  EXPECT_FALSE(caster.Inside({1.25, 0.1, 0.1}));
}

TEST(RayCasterTest, InsideForgivesHolesAndInwardWinding) {
  TriangleMesh mesh = Refine(UnitBox(), 0.3);
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  mesh.triangles.resize(mesh.triangles.size() * 9 / 10);
  const RayCaster caster(mesh);
  EXPECT_TRUE(caster.Inside({0.05, 0.02, 0}));
  EXPECT_FALSE(caster.Inside({0.9, 0.2, 0.1}));
  EXPECT_FALSE(caster.Inside({0, 0, 0.9}));
}

TEST(RayCasterTest, NothingIsInAnEmptyScene) {
  const RayCaster caster(TriangleMesh{});
  EXPECT_FALSE(caster.Cast({0, 0, 0}, Vec3::UnitX(), 100));
  EXPECT_FALSE(caster.Occluded({0, 0, 0}, {1, 0, 0}));
  EXPECT_FALSE(caster.Inside({0, 0, 0}));
}

TEST(RayCasterTest, AnswersManyThreadsAsOne) {
  const RayCaster caster(UnitBox());
  std::vector<double> ranges(2000);
  ParallelFor(ranges.size(), [&](std::size_t i) {
    const double y = 0.4 * std::sin(0.01 * static_cast<double>(i));
    ranges[i] = caster.Cast({-3, y, 0.1}, Vec3::UnitX(), 10)->range_m;
  });
  for (const double range_m : ranges) ASSERT_NEAR(range_m, 2.5, kTolerance_m);
}

TEST(RayCasterTest, RealMeshesHaveAnOutside) {
  const std::filesystem::path folder = VOG_SOURCE_DIR "/../shared/data/meshes";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is absent";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const TriangleMesh mesh = LoadMesh(entry.path(), 1);
    const RayCaster caster(mesh);
    const Eigen::AlignedBox3d bounds = mesh.Bounds();
    EXPECT_FALSE(caster.Inside(bounds.max() + Vec3(0.1, 0.1, 0.1))) << entry.path();
    EXPECT_FALSE(caster.Inside(bounds.min() - Vec3(0.1, 0.1, 0.1))) << entry.path();
    const Vec3 eye = bounds.center() + bounds.diagonal();
    const Vec3 target = mesh.vertices[mesh.triangles[0][0]];
    EXPECT_TRUE(caster.Cast(eye, (bounds.center() - eye).normalized(), 1000) ||
                caster.Cast(eye, (target - eye).normalized(), 1000))
        << entry.path();
  }
}

}  // namespace
}  // namespace vog
