#include "lib/submap/submap_builder.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "lib/submap/open_submap.h"
#include "lib/submap/scans_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

class SubmapBuilderTest : public testing::Test {
 protected:
  SubmapBuilder Builder() const { return {options_, model_, drift_}; }

  std::vector<RegisteredScan> Course(int scans, std::int64_t segment = 1, int first = 0) {
    std::vector<RegisteredScan> course;
    for (int step = first; step < first + scans; ++step)
      course.push_back(ScanOnCourse(step, segment, random_));
    return course;
  }

  /// The grid of some scans in the frame of the first, built with nothing but a ScanInserter.
  BrickGrid GridOfScans(const std::vector<RegisteredScan>& scans) const {
    BrickGrid grid(options_.voxel_size_m);
    ScanInserter inserter(SensorModel(model_), options_.voxel_size_m);
    for (const RegisteredScan& scan : scans)
      inserter.Insert(scan.scan, Ominus(scans[0].odometry.X_OB, scan.odometry.X_OB), grid);
    return grid;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  SubmapOptions options_{.voxel_size_m = 0.2, .scans_per_submap = 10};
  SensorModelOptions model_;
  DriftOptions drift_;
};

TEST_F(SubmapBuilderTest, ClosesASubmapWithItsLastScan) {
  SubmapBuilder dut = Builder();
  const auto course = Course(25);
  std::vector<SubmapPtr> submaps;
  for (std::size_t i = 0; i < course.size(); ++i) {
    const SubmapPtr closed = dut.Add(course[i]);
    EXPECT_EQ(closed != nullptr, i % 10 == 9);
    EXPECT_EQ(dut.open() == nullptr, i % 10 == 9);
    const auto& base = course[i - i % 10].odometry.X_OB;
    EXPECT_TRUE(dut.X_MB().isApprox(Ominus(base, course[i].odometry.X_OB), 1e-12));
    if (closed) submaps.push_back(closed);
  }
  submaps.push_back(dut.Close());  // The last, partial one.
  EXPECT_EQ(dut.Close(), nullptr);

  ASSERT_EQ(submaps.size(), 3u);
  for (int id = 0; id < 3; ++id) {
    const std::vector<RegisteredScan> scans(course.begin() + 10 * id,
                                            id == 2 ? course.end() : course.begin() + 10 * id + 10);
    const Submap& submap = *submaps[id];
    EXPECT_EQ(submap.id(), id);
    EXPECT_EQ(submap.scans, static_cast<int>(scans.size()));
    EXPECT_EQ(submap.first_scan, scans.front().scan.time);
    EXPECT_EQ(submap.last_scan, scans.back().scan.time);
    EXPECT_TRUE(submap.base.odometry.X_OB.isApprox(scans.front().odometry.X_OB, 0));
    EXPECT_TRUE(submap.drift.isApprox(
        MotionCovariance(scans.front().odometry, scans.back().odometry), 1e-12));
    BrickGrid grid = GridOfScans(scans);
    EXPECT_EQ(TableOf(submap.grid), TableOf(grid));
    grid.Compact();
    EXPECT_EQ(submap.grid.memory_bytes(), grid.memory_bytes());
  }
}

TEST_F(SubmapBuilderTest, EdgesAreTheMotionBetweenTheBases) {
  SubmapBuilder dut = Builder();
  const auto course = Course(21);
  std::vector<SubmapPtr> submaps;
  for (const RegisteredScan& scan : course)
    if (const SubmapPtr closed = dut.Add(scan)) submaps.push_back(closed);
  const OdometrySample &a = course[0].odometry, &b = course[10].odometry;
  const OdometryEdge& edge = submaps[1]->base.edge;
  EXPECT_TRUE(edge.X_PM.isApprox(Ominus(a.X_OB, b.X_OB), 1e-12));
  const Mat3 planar = MotionCovariance(a, b);
  const int planar_index[3] = {0, 1, 5};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(edge.covariance(planar_index[i], planar_index[k]), planar(i, k), 1e-15);
  // z, roll and pitch are measured at both ends and do not depend on the way between.
  EXPECT_NEAR(edge.covariance(2, 2), 2 * std::pow(drift_.sigma_z_m, 2), 1e-15);
  EXPECT_NEAR(edge.covariance(3, 3), 2 * std::pow(drift_.sigma_roll_pitch_rad, 2), 1e-15);
  EXPECT_NEAR(edge.covariance(4, 4), edge.covariance(3, 3), 1e-15);
  EXPECT_TRUE(submaps[0]->base.edge.X_PM.isApprox(Pose3::Identity(), 0));
}

TEST_F(SubmapBuilderTest, ClosesASubmapWhenItsDriftPassesTheLimit) {
  options_.scans_per_submap = 1000;
  // ScanOnCourse() adds 1e-4 m^2 and 1e-6 rad^2 a scan.
  for (const bool by_yaw : {false, true}) {
    options_.max_sigma_xy_m = by_yaw ? 100 : std::sqrt(15.5e-4);
    options_.max_sigma_yaw_rad = by_yaw ? std::sqrt(7.5e-6) : 3;
    SubmapBuilder dut = Builder();
    int scans = 0;
    SubmapPtr closed;
    for (const RegisteredScan& scan : Course(100)) {
      ++scans;
      if ((closed = dut.Add(scan))) break;
    }
    ASSERT_NE(closed, nullptr);
    const double sigma = std::sqrt(by_yaw ? closed->drift(2, 2)
                                          : std::max(closed->drift(0, 0), closed->drift(1, 1)));
    EXPECT_LE(sigma, by_yaw ? options_.max_sigma_yaw_rad : options_.max_sigma_xy_m);
    EXPECT_EQ(closed->scans, scans - 1) << "the scan that was too far belongs to the next";
    EXPECT_EQ(dut.open()->scans, 1);
    EXPECT_LE(scans, by_yaw ? 9 : 17);
    EXPECT_GE(scans, by_yaw ? 8 : 10);
  }
}

// As after a minute without bottom lock.
TEST_F(SubmapBuilderTest, NothingIsMappedAcrossAStretchThatNobodyKnows) {
  SubmapBuilder dut = Builder();
  std::vector<RegisteredScan> scans = Course(8);
  for (std::size_t i = 4; i < scans.size(); ++i)
    scans[i].odometry.covariance += Vec3(4, 4, 1e-4).asDiagonal();
  SubmapPtr closed;
  for (std::size_t i = 0; i < 4; ++i) ASSERT_EQ(dut.Add(scans[i]), nullptr);
  closed = dut.Add(scans[4]);
  ASSERT_NE(closed, nullptr);
  EXPECT_EQ(closed->scans, 4);
  EXPECT_EQ(closed->last_scan, scans[3].scan.time);
  for (std::size_t i = 5; i < scans.size(); ++i) ASSERT_EQ(dut.Add(scans[i]), nullptr);
  const OdometryEdge& edge = dut.open()->base.edge;
  const Pose3 motion = Ominus(scans[0].odometry.X_OB, scans[4].odometry.X_OB);
  EXPECT_TRUE(edge.X_PM.isApprox(motion, 1e-12));
  EXPECT_GT(edge.covariance(0, 0), 4);
}

TEST_F(SubmapBuilderTest, MayCloseWithEveryScan) {
  options_.scans_per_submap = 1;
  SubmapBuilder dut = Builder();
  int id = 0;
  for (const RegisteredScan& scan : Course(5)) {
    const SubmapPtr closed = dut.Add(scan);
    ASSERT_NE(closed, nullptr);
    EXPECT_EQ(closed->id(), id++);
    EXPECT_EQ(closed->first_scan, closed->last_scan);
    EXPECT_TRUE(closed->drift.isZero(1e-15));
  }
}

TEST_F(SubmapBuilderTest, ANewSegmentClosesTheOpenSubmapAndWidensTheEdge) {
  SubmapBuilder dut = Builder();
  for (const RegisteredScan& scan : Course(4)) EXPECT_EQ(dut.Add(scan), nullptr);
  const auto later = Course(10, 2, 100);  // 20 s later.
  const SubmapPtr before = dut.Add(later[0]);
  ASSERT_NE(before, nullptr);
  EXPECT_EQ(before->id(), 0);
  EXPECT_EQ(before->scans, 4);
  ASSERT_NE(dut.open(), nullptr);
  EXPECT_EQ(dut.open()->id(), 1);
  EXPECT_EQ(dut.open()->scans, 1);

  const OdometryEdge edge = dut.open()->base.edge;
  const double gap_s = ToSeconds(later[0].scan.time - before->last_scan);
  EXPECT_GE(edge.covariance(0, 0), std::pow(options_.gap_speed_m_s * gap_s, 2));
  EXPECT_GE(edge.covariance(1, 1), std::pow(options_.gap_speed_m_s * gap_s, 2));
  EXPECT_GE(edge.covariance(5, 5), std::pow(options_.gap_yaw_rate_rad_s * gap_s, 2));
  EXPECT_LT(edge.covariance(2, 2), 0.01);  // Depth is measured, gap or not.
  const double climbed_m =
      later[0].odometry.X_OB.translation().z() - before->base.odometry.X_OB.translation().z();
  EXPECT_NEAR((before->base.odometry.X_OB * edge.X_PM).translation().z() -
                  before->base.odometry.X_OB.translation().z(),
              climbed_m, 1e-3);
  for (std::size_t i = 1; i < later.size(); ++i)
    EXPECT_EQ(dut.Add(later[i]) != nullptr, i + 1 == later.size());
}

// The bridge was started again, but the vehicle's own computer reckoned on.
TEST_F(SubmapBuilderTest, ANewSegmentOfTheSameOriginKeepsTheMotion) {
  SubmapBuilder dut = Builder();
  const auto before = Course(8);
  for (const RegisteredScan& scan : before) dut.Add(scan);
  auto after = Course(1, 2, 12);
  after[0].odometry.origin = 1;
  after[0].odometry.covariance.setZero();
  ASSERT_NE(dut.Add(after[0]), nullptr);
  const OdometryEdge& edge = dut.open()->base.edge;
  EXPECT_TRUE(edge.X_PM.isApprox(Ominus(before[0].odometry.X_OB, after[0].odometry.X_OB), 1e-12));
  // ScanOnCourse() adds as much with every scan.
  const Mat3 unbroken = MotionCovariance(before[0].odometry, ScanOnCourse(12, 1, random_).odometry);
  EXPECT_NEAR(edge.covariance(0, 0), unbroken(0, 0), 0.1 * unbroken(0, 0));
  EXPECT_NEAR(edge.covariance(5, 5), unbroken(2, 2), 0.1 * unbroken(2, 2));
}

// The map service was started again: what it knows of the last submap is in its folder.
TEST_F(SubmapBuilderTest, ARestartMeasuresTheGapFromTheLastScan) {
  SubmapBuilder before = Builder(), dut = Builder();
  SubmapPtr last;
  for (const RegisteredScan& scan : Course(10)) last = before.Add(scan);
  ASSERT_NE(last, nullptr);
  dut.ContinueAfter(*last);
  const auto after = Course(1, 2, 14);
  before.Add(after[0]);
  dut.Add(after[0]);
  const OdometryEdge &edge = dut.open()->base.edge, &unbroken = before.open()->base.edge;
  EXPECT_TRUE(edge.X_PM.isApprox(unbroken.X_PM, 1e-12));
  EXPECT_TRUE(edge.covariance.isApprox(unbroken.covariance, 1e-9));
}

TEST_F(SubmapBuilderTest, GoesOnAfterTheSubmapsOfAnEarlierRun) {
  const SubmapPtr last = RandomSubmap(41, options_.voxel_size_m, random_);
  SubmapBuilder dut = Builder();
  dut.ContinueAfter(*last);
  EXPECT_EQ(dut.open(), nullptr);
  dut.Add(Course(1)[0]);
  EXPECT_EQ(dut.open()->id(), 42);
  // Another segment: nothing is known of the way between, and the edge says so.
  EXPECT_GT(dut.open()->base.edge.covariance(0, 0), 1e-4);
}

TEST_F(SubmapBuilderTest, ADroppedSubmapLeavesNoTrace) {
  SubmapBuilder dut = Builder(), other = Builder();
  const auto course = Course(25);
  for (int i = 0; i < 15; ++i) dut.Add(course[i]);
  dut.Drop();
  EXPECT_EQ(dut.open(), nullptr);
  for (int i = 0; i < 10; ++i) other.Add(course[i]);
  for (int i = 15; i < 25; ++i) {
    dut.Add(course[i]);
    other.Add(course[i]);
  }
  EXPECT_TRUE(
      dut.EdgeTo(course[24].odometry).X_PM.isApprox(other.EdgeTo(course[24].odometry).X_PM, 1e-12));
  EXPECT_EQ(dut.Close(), nullptr);
  dut.Add(course[24]);
  EXPECT_EQ(dut.open()->id(), 2);
}

TEST_F(SubmapBuilderTest, AFlightBeginsWhereTheVehicleWasPutIn) {
  SubmapBuilder first = Builder();
  SubmapPtr last;
  for (const RegisteredScan& scan : Course(10)) last = first.Add(scan);
  ASSERT_NE(last, nullptr);
  const PlaceInMap place{
      {}, MakePose({1, -2, 0.5}, {0, 0, 0.3}), Vec3(0.09, 0.08, 0.01).asDiagonal()};
  const double z_W_m = (last->base.odometry.X_OB * place.X_ME).translation().z();
  // The same origin and segment as before: what odometry says of the time between does not count.
  std::vector<RegisteredScan> course = Course(13, /*segment=*/1, /*first=*/40);
  SubmapBuilder dut = Builder();
  dut.BeginFlight(*last, place);
  const OdometryEdge before = dut.EdgeTo(course[0].odometry);
  const SubmapPtr closed = [&] {
    SubmapPtr submap;
    for (int i = 0; i < 10; ++i) submap = dut.Add(course[i]);
    return submap;
  }();
  ASSERT_NE(closed, nullptr);
  EXPECT_EQ(closed->id(), last->id() + 1);
  const OdometryEdge& edge = closed->base.edge;
  EXPECT_TRUE(edge.X_PM.isApprox(before.X_PM, 1e-12));
  const double risen_m = course[0].odometry.X_OB.translation().z() - z_W_m;
  EXPECT_TRUE(edge.X_PM.isApprox(place.X_ME * MakePose({0, 0, risen_m}), 1e-12)) << "but the depth";
  EXPECT_TRUE(PlanarOf(edge.covariance).isApprox(place.covariance, 1e-12));
  EXPECT_NEAR(edge.covariance(2, 2), 2 * std::pow(drift_.sigma_z_m, 2), 1e-15);
  // From then on it is odometry's again.
  dut.Add(course[10]);
  EXPECT_TRUE(dut.open()->base.edge.X_PM.isApprox(
      Ominus(course[0].odometry.X_OB, course[10].odometry.X_OB), 1e-12));
}

TEST_F(SubmapBuilderTest, AFlightWhoseFirstSubmapWasLostGoesOnFromThere) {
  SubmapBuilder first = Builder();
  SubmapPtr last;
  for (const RegisteredScan& scan : Course(10)) last = first.Add(scan);
  SubmapBuilder lost = Builder();
  lost.BeginFlight(*last, {{}, MakePose({1, -2, 0}), 0.09 * Mat3::Identity()});
  const std::vector<RegisteredScan> course = Course(5, /*segment=*/1, /*first=*/40);
  for (const RegisteredScan& scan : course) lost.Add(scan);
  const SubmapBase base = lost.open()->base;
  SubmapBuilder dut = Builder();
  dut.ContinueFlight(base);
  dut.Add(course[4]);
  EXPECT_EQ(dut.open()->id(), last->id() + 1);
  const OdometryEdge& edge = dut.open()->base.edge;
  const Pose3 moved = Ominus(course[0].odometry.X_OB, course[4].odometry.X_OB);
  EXPECT_TRUE(edge.X_PM.isApprox(base.edge.X_PM * moved, 1e-12));
  EXPECT_TRUE(PlanarOf(edge.covariance)
                  .isApprox(ComposePlanarCovariance(
                                PlanarOf(base.edge.covariance), moved,
                                MotionCovariance(course[0].odometry, course[4].odometry)),
                            1e-12));
}

TEST_F(SubmapBuilderTest, EdgesAreValidCovariances) {
  SubmapBuilder dut = Builder();
  for (int segment = 1; segment < 6; ++segment)
    for (const RegisteredScan& scan : Course(3 + segment, segment, 40 * segment)) {
      const SubmapPtr closed = dut.Add(scan);
      if (closed == nullptr || closed->id() == 0) continue;
      const Mat6& covariance = closed->base.edge.covariance;
      EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-12));
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(covariance).eigenvalues()[0], 0);
    }
}

TEST_F(SubmapBuilderTest, AnOpenSubmapShowsTheScansThatNoClosedOneHolds) {
  options_.scans_per_submap = 7;
  SubmapBuilder builder = Builder();
  OpenSubmap dut(options_.voxel_size_m, model_);
  EXPECT_EQ(dut.grid(), nullptr);
  std::vector<RegisteredScan> course = Course(20);
  const auto after_gap = Course(10, 2, 50);
  course.insert(course.end(), after_gap.begin(), after_gap.end());
  for (const RegisteredScan& scan : course) {
    dut.Add(scan);
    if (const SubmapPtr closed = builder.Add(scan)) dut.ForgetUpTo(closed->last_scan);
    const Submap* open = builder.open();
    ASSERT_EQ(dut.grid() != nullptr, open != nullptr);
    if (open == nullptr) continue;
    EXPECT_EQ(TableOf(*dut.grid()), TableOf(open->grid));
    EXPECT_TRUE(dut.base().X_OB.isApprox(open->base.odometry.X_OB, 0));
  }
}

TEST_F(SubmapBuilderTest, AnOpenSubmapHearsOfAClosedOneLate) {
  OpenSubmap dut(options_.voxel_size_m, model_);
  const auto course = Course(12);
  for (const RegisteredScan& scan : course) dut.Add(scan);
  dut.ForgetUpTo(course[6].scan.time);
  EXPECT_EQ(TableOf(*dut.grid()), TableOf(GridOfScans({course.begin() + 7, course.end()})));
  dut.ForgetUpTo(course[2].scan.time);  // Older news change nothing.
  EXPECT_EQ(dut.base().time, course[7].odometry.time);
  dut.ForgetUpTo(course.back().scan.time);
  EXPECT_EQ(dut.grid(), nullptr);
}

}  // namespace
}  // namespace vog
