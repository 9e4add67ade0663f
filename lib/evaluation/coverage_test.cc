#include "lib/evaluation/coverage.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/scan/sonar.h"

namespace vog {
namespace {

/// The six sides of a box as triangles, wound to be seen from outside or from inside.
TriangleMesh BoxMesh(const Eigen::AlignedBox3d& box, bool from_inside) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upper : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Vec3 corner = box.min();
      if (upper) corner[axis] = box.max()[axis];
      const Vec3 along = box.sizes()[u] * Vec3::Unit(u), up = box.sizes()[v] * Vec3::Unit(v);
      TriangleMesh side{.vertices = {corner, corner + along, corner + along + up, corner + up},
                        .triangles = {{0, 1, 2}, {0, 2, 3}}};
      if (upper == from_inside)
        for (auto& t : side.triangles) std::swap(t[1], t[2]);
      mesh.Append(side);
    }
  }
  return mesh;
}

/// A scan with one beam along x of S for each direction.
std::vector<Scan> ScansAlong(const std::vector<Vec3>& directions_B, const Eigen::AlignedBox3d& room,
                             const Vec3& p_W) {
  std::vector<Scan> scans;
  for (const Vec3& direction : directions_B) {
    double range_m = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double side = direction[axis] > 0 ? room.max()[axis] : room.min()[axis];
      if (std::abs(direction[axis]) > 1e-9)
        range_m = std::min(range_m, (side - p_W[axis]) / direction[axis]);
    }
    Scan scan{Time{}, 0, Pose3::Identity(), 0.1, 20, {}};
    scan.X_BS.linear() =
        Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), direction).toRotationMatrix();
    scan.beams = {{0, static_cast<float>(range_m), 1, BeamStatus::kReturn}};
    scans.push_back(scan);
  }
  return scans;
}

std::vector<Vec3> RandomDirections(int count, Random& random) {
  std::vector<Vec3> directions;
  for (int i = 0; i < count; ++i)
    directions.push_back(random.GaussianVector(Vec3::Ones()).normalized());
  return directions;
}

const Eigen::AlignedBox3d kRoom(Vec3(-2, -1.5, -1), Vec3(2, 1.5, 1));

TEST(SampleSurfaceTest, SpreadsAsManySamplesAsTheAreaHasRoomFor) {
  const TriangleMesh mesh = BoxMesh(kRoom, true);
  const auto samples = SampleSurface(mesh, 0.05);
  const double area_m2 = 2 * (4 * 3 + 4 * 2 + 3 * 2);
  EXPECT_NEAR(static_cast<double>(samples.size()), area_m2 / 0.0025, 2);
  Vec3 mean = Vec3::Zero();
  for (const SurfaceSample& sample : samples) {
    // On the surface, with a normal towards the inside.
    const Vec3 from_side = (kRoom.max() - sample.position_W_m.cwiseAbs()).cwiseAbs();
    EXPECT_LT(from_side.minCoeff(), 1e-9);
    EXPECT_LT(sample.normal_W.dot(sample.position_W_m), 0);
    EXPECT_NEAR(sample.normal_W.norm(), 1, 1e-9);
    mean += sample.position_W_m / static_cast<double>(samples.size());
  }
  EXPECT_LT(mean.norm(), 0.02);
  // Everywhere: no place of the surface is far from a sample.
  Random random(1, "surface");
  for (int i = 0; i < 300; ++i) {
    const Vec3 p(2, random.Uniform(-1.5, 1.5), random.Uniform(-1, 1));
    double least_m = 1e9;
    for (const SurfaceSample& sample : samples)
      least_m = std::min(least_m, (sample.position_W_m - p).norm());
    EXPECT_LT(least_m, 0.12);
  }
}

TEST(SampleSurfaceTest, SmallTrianglesShareASample) {
  TriangleMesh mesh;
  for (int i = 0; i < 1000; ++i) {
    const double x = 0.01 * i;
    mesh.Append({.vertices = {{x, 0, 0}, {x + 0.01, 0, 0}, {x, 0.2, 0}}, .triangles = {{0, 1, 2}}});
  }
  EXPECT_NEAR(static_cast<double>(SampleSurface(mesh, 0.1).size()), 1000 * 0.001 / 0.01, 1);
  EXPECT_TRUE(SampleSurface({}, 0.1).empty());
}

/// Two chambers of a building: the vehicle fits into the first, and through a door of 1 m into the
/// second unless it is shut; the third has no door.
struct Chambers {
  bool door_is_open = true;

  static int ChamberOf(const Vec3& p) { return p.x() < 3 ? 0 : p.x() < 6 ? 1 : 2; }
  bool HullFits(const Vec3& p) const {
    if (p.x() < 0.5 || p.x() > 8.5 || p.y() < 0.5 || p.y() > 3.5) return false;
    const bool in_wall = std::abs(p.x() - 3) < 0.5 || std::abs(p.x() - 6) < 0.5;
    const bool in_door = door_is_open && std::abs(p.x() - 3) < 0.5 && std::abs(p.y() - 2) < 0.3;
    return !in_wall || in_door;
  }
  TrueWorld World() const {
    return {[](const Vec3& a, const Vec3& b) { return ChamberOf(a) != ChamberOf(b); },
            [this](const Vec3& p) { return HullFits(p); }};
  }
  static Eigen::AlignedBox3d Box() { return {Vec3(0, 0, -0.3), Vec3(9, 4, 0.3)}; }
};

TEST(ReachabilityTest, FloodsThroughDoorsAndNoFarther) {
  Chambers chambers;
  const TrueWorld world = chambers.World();
  const Reachability open(world, Chambers::Box(), {1, 1, 0}, 0.25);
  int places[3] = {0, 0, 0};
  for (const Vec3& p : open.places_W()) {
    EXPECT_TRUE(chambers.HullFits(p));
    EXPECT_TRUE(Chambers::Box().contains(p));
    ++places[Chambers::ChamberOf(p)];
  }
  EXPECT_GT(places[0], 100);
  EXPECT_GT(places[1], 100);
  EXPECT_EQ(places[2], 0) << "a pocket without a door";
  // As many as the lattice has that fit, counted one by one.
  int expected = 0;
  for (int x = -10; x < 40; ++x)
    for (int y = -10; y < 20; ++y)
      for (int z = -1; z <= 1; ++z) {
        const Vec3 p = Vec3(1, 1, 0) + 0.25 * Vec3(x, y, z);
        expected += Chambers::Box().contains(p) && chambers.HullFits(p) && p.x() < 6;
      }
  EXPECT_EQ(static_cast<int>(open.places_W().size()), expected);

  chambers.door_is_open = false;
  const TrueWorld shut_world = chambers.World();
  const Reachability shut(shut_world, Chambers::Box(), {1, 1, 0}, 0.25);
  for (const Vec3& p : shut.places_W()) EXPECT_EQ(Chambers::ChamberOf(p), 0);
}

TEST(ReachabilityTest, SeesWhatIsNearInLineOfSightAndFacesIt) {
  const Chambers chambers;
  const TrueWorld world = chambers.World();
  const Reachability dut(world, Chambers::Box(), {1, 1, 0}, 0.25);
  const Vec3 up = Vec3::UnitZ(), down = -up;
  EXPECT_TRUE(dut.IsVisible({4, 2, -1}, 2));
  EXPECT_TRUE(dut.IsVisible({4, 2, -1}, 2, &up));
  EXPECT_FALSE(dut.IsVisible({4, 2, -1}, 2, &down));
  EXPECT_FALSE(dut.IsVisible({4, 2, -1}, 0.5)) << "too far";
  EXPECT_FALSE(dut.IsVisible({7, 2, 0}, 50)) << "in the pocket";
}

TEST(ReachabilityTest, NothingIsReachableFromInsideAWall) {
  const Chambers chambers;
  const TrueWorld world = chambers.World();
  const Reachability dut(world, Chambers::Box(), {6, 1, 0}, 0.25);
  EXPECT_TRUE(dut.places_W().empty());
  EXPECT_FALSE(dut.IsVisible({4, 2, 0}, 50));
}

TEST(SurfaceCoverageTest, CountsTheSamplesNearEndPointsByBruteForce) {
  Random random(2, "coverage");
  const auto samples = SampleSurface(BoxMesh(kRoom, true), 0.1);
  SurfaceCoverage dut(samples, 0.15);
  std::vector<bool> expected(samples.size(), false);
  const Vec3 p_W(0.3, -0.2, 0.1);
  for (const Vec3& direction : RandomDirections(300, random)) {
    const Scan scan = ScansAlong({direction}, kRoom, p_W)[0];
    dut.AddScan(scan, MakePose(p_W));
    const Vec3 end_W = p_W + scan.beams[0].range_m * direction;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if ((samples[i].position_W_m - end_W).norm() <= 0.15 &&
          samples[i].normal_W.dot(direction) < 0)
        expected[i] = true;
    }
  }
  EXPECT_EQ(dut.seen(), expected);
  const auto count = std::count(expected.begin(), expected.end(), true);
  EXPECT_DOUBLE_EQ(dut.curve().final_share(),
                   static_cast<double>(count) / static_cast<double>(samples.size()));
  EXPECT_GT(count, 100);
  EXPECT_LT(count, static_cast<int>(samples.size()));
}

TEST(SurfaceCoverageTest, AllDirectionsSeeAllOfARoom) {
  Random random(3, "coverage");
  SurfaceCoverage dut(SampleSurface(BoxMesh(kRoom, true), 0.1), 0.3);
  for (const Scan& scan : ScansAlong(RandomDirections(4000, random), kRoom, Vec3::Zero()))
    dut.AddScan(scan, Pose3::Identity());
  EXPECT_GT(dut.curve().final_share(), 0.99);
}

TEST(SurfaceCoverageTest, TheFarSideOfASurfaceIsNotSeen) {
  Random random(4, "coverage");
  SurfaceCoverage dut(SampleSurface(BoxMesh(kRoom, false), 0.1), 0.3);
  for (const Scan& scan : ScansAlong(RandomDirections(500, random), kRoom, Vec3::Zero()))
    dut.AddScan(scan, Pose3::Identity());
  EXPECT_EQ(dut.curve().final_share(), 0);
}

TEST(SurfaceCoverageTest, TurnsTheScanWithBodyAndServo) {
  // One sample straight above; the body is rolled and the servo makes up for it.
  SurfaceCoverage dut({{{1, 2, 6}, -Vec3::UnitZ()}}, 0.01);
  Scan scan{FromUtime(3'000'000), 0, MakePose({0.5, 0, 0}), 0.1, 20, {}};
  const Pose3 X_WS = MakePose({1, 2, 3}, {0, -EIGEN_PI / 2, 0.3});
  scan.X_BS = MakePose({0.5, 0.2, -0.1}, {0.2, -0.3, 0.1});
  scan.beams = {{0, 3, 1, BeamStatus::kReturn}};
  dut.AddScan(scan, X_WS * scan.X_BS.inverse());
  EXPECT_EQ(dut.curve().final_share(), 1);
  EXPECT_EQ(dut.curve().points.back().time_s, 3);
}

TEST(SurfaceCoverageTest, SilentBeamsSeeNothing) {
  SurfaceCoverage dut({{{2, 0, 0}, -Vec3::UnitX()}}, 0.1);
  Scan scan{Time{}, 0, Pose3::Identity(), 0.1, 2, {}};
  scan.beams = {{0, 2, 0, BeamStatus::kClear}, {0, 2, 0, BeamStatus::kUncertain}};
  dut.AddScan(scan, Pose3::Identity());
  EXPECT_EQ(dut.curve().final_share(), 0);
}

TEST(CoverageCurveTest, TellsWhenAShareIsReached) {
  const CoverageCurve curve{{{1, 0.1}, {2, 0.5}, {3, 0.9}}};
  EXPECT_EQ(curve.TimeTo(0.5), 2);
  EXPECT_EQ(curve.TimeTo(0.51), 3);
  EXPECT_EQ(curve.TimeTo(0), 1);
  EXPECT_FALSE(curve.TimeTo(0.95).has_value());
  EXPECT_EQ(CoverageCurve{}.final_share(), 0);
}

TEST(VolumeCoverageTest, CountsReachableVoxelsThatBeamsPass) {
  Random random(5, "coverage");
  const Eigen::AlignedBox3d room(Vec3(-1.9, -1.3, -0.9), Vec3(1.9, 1.3, 0.9));
  const VoxelGrid grid(0.2);
  const VoxelBox box{{-12, -9, -6}, {11, 8, 5}};
  std::vector<bool> reachable(box.count());
  for (std::size_t i = 0; i < reachable.size(); ++i) reachable[i] = random.Chance(0.7);
  VolumeCoverage dut(grid, box, reachable);
  std::vector<bool> seen(box.count(), false);
  for (const Vec3& direction : RandomDirections(150, random)) {
    const Scan scan = ScansAlong({direction}, room, Vec3(0.11, 0.07, 0.03))[0];
    dut.AddScan(scan, MakePose({0.11, 0.07, 0.03}));
    for (double s = scan.min_range_m; s <= scan.beams[0].range_m; s += 1e-4) {
      const VoxelKey key = grid.KeyOf(Vec3(0.11, 0.07, 0.03) + s * direction);
      if (box.Contains(key)) seen[box.IndexOf(key)] = true;
    }
  }
  int count = 0, all = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    count += seen[i] && reachable[i];
    all += reachable[i];
  }
  // The samples may step over the corner of a voxel.
  EXPECT_NEAR(dut.curve().final_share(), count / static_cast<double>(all), 2.0 / all);
  EXPECT_GT(count, 100);
}

TEST(VolumeCoverageTest, SilenceIsFreeOnlyWhereItIsSure) {
  const VoxelGrid grid(0.2);
  const VoxelBox box{{0, 0, 0}, {9, 0, 0}};
  VolumeCoverage dut(grid, box, std::vector<bool>(box.count(), true));
  Scan scan{Time{}, 0, MakePose({0.01, 0.1, 0.1}), 0, 1.0, {}};
  scan.beams = {{0, 0, 0, BeamStatus::kUncertain}};
  dut.AddScan(scan, Pose3::Identity());
  EXPECT_EQ(dut.curve().final_share(), 0);
  scan.beams = {{0, 0, 0, BeamStatus::kClear}};
  dut.AddScan(scan, Pose3::Identity());
  EXPECT_NEAR(dut.curve().final_share(), 0.6, 1e-9);  // Up to 1.01 m: voxels 0 to 5.
  EXPECT_EQ(dut.curve().points.size(), 2u);
}

}  // namespace
}  // namespace vog
