#include "lib/control/path_follower.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "lib/base/random.h"

namespace vog {
namespace {

constexpr double kStep_s = 0.1;

/// A vehicle that does at once what it is told.
struct Flight {
  explicit Flight(const ControllerOptions& options = {}) : follower(options), options(options) {}

  void Step() {
    const VelocityCommand command = follower.Step(X_WB, kStep_s);
    EXPECT_LE(command.velocity_B_m_s.norm(), options.max_speed_m_s + 1e-9);
    EXPECT_LE(std::abs(command.yaw_rate_rad_s), options.max_yaw_rate_rad_s + 1e-9);
    EXPECT_TRUE(command.velocity_B_m_s.allFinite());
    const Vec3 p_W = X_WB * Vec3(kStep_s * command.velocity_B_m_s);
    const RollPitchYaw angles = AnglesOf(X_WB);
    X_WB = MakePose(
        p_W, {angles.roll, angles.pitch, WrapAngle(angles.yaw + kStep_s * command.yaw_rate_rad_s)});
    turned_rad += std::abs(kStep_s * command.yaw_rate_rad_s);
    flown_m += kStep_s * command.velocity_B_m_s.norm();
  }
  void Run(double seconds) {
    for (int i = 0; i < seconds / kStep_s; ++i) Step();
  }
  bool IsAt(const Waypoint& at) const {
    return (X_WB.translation() - at.position_W_m).norm() < 0.02 &&
           std::abs(WrapAngle(YawOf(X_WB) - at.yaw_rad)) < 0.02;
  }

  PathFollower follower;
  ControllerOptions options;
  Pose3 X_WB = Pose3::Identity();
  double turned_rad = 0, flown_m = 0;
};

double DistanceFromPath(const std::vector<Waypoint>& path, const Vec3& p_W) {
  double least_m = 1e9;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 a = path[i].position_W_m, along = path[i + 1].position_W_m - a;
    const double t =
        std::clamp((p_W - a).dot(along) / std::max(along.squaredNorm(), 1e-12), 0., 1.);
    least_m = std::min(least_m, (p_W - a - t * along).norm());
  }
  return least_m;
}

std::vector<Waypoint> RandomPath(int waypoints, Random& random) {
  std::vector<Waypoint> path = {{}};
  while (static_cast<int>(path.size()) < waypoints)
    path.push_back({path.back().position_W_m + random.GaussianVector({1, 1, 0.5}),
                    random.Uniform(-std::numbers::pi, std::numbers::pi)});
  return path;
}

TEST(PathFollowerTest, ReachesTheEndOfRandomPathsAndStaysThere) {
  Random random(1, "path");
  for (int i = 0; i < 20; ++i) {
    Flight flight;
    const auto path = RandomPath(5, random);
    flight.follower.Follow(path);
    double duration_s = 20;
    for (std::size_t leg = 0; leg + 1 < path.size(); ++leg)
      duration_s += std::max(LengthOf(path[leg], path[leg + 1]) / flight.options.max_speed_m_s,
                             std::abs(WrapAngle(path[leg + 1].yaw_rad - path[leg].yaw_rad)) /
                                 flight.options.max_yaw_rate_rad_s);
    flight.Run(duration_s);
    EXPECT_TRUE(flight.follower.TargetAtEnd());
    EXPECT_TRUE(flight.IsAt(path.back())) << i;
    flight.Run(10);
    EXPECT_TRUE(flight.IsAt(path.back())) << i;
  }
}

TEST(PathFollowerTest, KeepsToTheStraightLines) {
  Random random(2, "path");
  for (int i = 0; i < 10; ++i) {
    Flight flight;
    const auto path = RandomPath(5, random);
    flight.follower.Follow(path);
    for (int step = 0; step < 1500; ++step) {
      flight.Step();
      ASSERT_LT(DistanceFromPath(path, flight.X_WB.translation()), 0.06) << i << " " << step;
    }
  }
}

TEST(PathFollowerTest, FliesLongLegsAtFullSpeed) {
  Flight flight;
  flight.follower.Follow({{}, {{5, 0, 0}, 0}});
  flight.Run(5);
  EXPECT_NEAR(flight.flown_m, 5 * flight.options.max_speed_m_s, 0.05);
  EXPECT_NEAR(flight.X_WB.translation().x(), flight.flown_m, 1e-6);
}

TEST(PathFollowerTest, PassesEachWaypointInItsTurn) {
  const std::vector<Waypoint> path = {{}, {{1, 0, 0}, 0}, {{1, 1, 0}, 1}, {{0, 1, 0.5}, 2}};
  Flight flight;
  flight.follower.Follow(path);
  std::size_t next = 1;
  for (int step = 0; step < 600 && next < path.size(); ++step) {
    flight.Step();
    if ((flight.X_WB.translation() - path[next].position_W_m).norm() < 0.08) ++next;
  }
  EXPECT_EQ(next, path.size());
}

TEST(PathFollowerTest, TurnsTheShorterWay) {
  const double almost = std::numbers::pi - 0.1;
  for (const double sign : {-1.0, 1.0}) {
    Flight flight;
    flight.X_WB = MakePose(Vec3::Zero(), {0, 0, sign * almost});
    const Waypoint goal{Vec3::Zero(), -sign * almost};
    flight.follower.Follow({{Vec3::Zero(), sign * almost}, goal});
    flight.Run(20);
    EXPECT_TRUE(flight.IsAt(goal));
    EXPECT_LT(flight.turned_rad, 0.3);
  }
}

TEST(PathFollowerTest, HeadingAndPlaceArriveTogether) {
  Flight flight;
  flight.follower.Follow({{}, {{1, 0, 0}, 1.5}});  // 4 s of way, 10 s of turning.
  flight.Run(5);
  EXPECT_NEAR(flight.X_WB.translation().x(), 0.5, 0.05);
  EXPECT_NEAR(YawOf(flight.X_WB), 0.75, 0.08);
}

TEST(PathFollowerTest, CommandIsInTheBodyFrame) {
  PathFollower dut({});
  dut.Follow({{{0, 0, 0}, 2}, {{3, 0, 0}, 2}});
  const Pose3 X_WB = MakePose({0, 0, 0}, {0.1, -0.1, 2});
  const VelocityCommand command = dut.Step(X_WB, kStep_s);
  const Vec3 velocity_W = X_WB.linear() * command.velocity_B_m_s;
  EXPECT_TRUE(velocity_W.isApprox(Vec3(0.25, 0, 0), 1e-9)) << velocity_W.transpose();
  EXPECT_EQ(command.yaw_rate_rad_s, 0);
}

TEST(PathFollowerTest, TheTargetWaitsForAVehicleThatFallsBehind) {
  PathFollower dut({});
  dut.Follow({{}, {{2, 0, 0}, 0}});
  for (int i = 0; i < 1000; ++i) dut.Step(Pose3::Identity(), kStep_s);  // It does not move.
  EXPECT_FALSE(dut.TargetAtEnd());
  // Pulled no farther than the allowed lag: half the gain times that, and the lead.
  EXPECT_GT(dut.Step(Pose3::Identity(), kStep_s).velocity_B_m_s.x(), 0);
  for (int i = 0; i < 1000; ++i) dut.Step(MakePose({2, 0, 0}), kStep_s);
  EXPECT_FALSE(dut.TargetAtEnd()) << "far ahead is as far away";
}

TEST(PathFollowerTest, ComesBackAfterBeingPushedAway) {
  Flight flight;
  const std::vector<Waypoint> path = {{}, {{2, 0, 0}, 0}};
  flight.follower.Follow(path);
  flight.Run(3);
  flight.X_WB = MakePose({1, 1.5, -0.5}, {0, 0, -2});
  flight.Run(60);
  EXPECT_TRUE(flight.IsAt(path.back()));
}

TEST(PathFollowerTest, WithoutAPathItStops) {
  PathFollower dut({});
  EXPECT_FALSE(dut.goal().has_value());
  const auto is_stop = [](const VelocityCommand& command) {
    return command.velocity_B_m_s.isZero() && command.yaw_rate_rad_s == 0;
  };
  EXPECT_TRUE(is_stop(dut.Step(MakePose({1, 2, 3}), kStep_s)));
  dut.Follow({{}, {{2, 0, 0}, 0}});
  EXPECT_FALSE(is_stop(dut.Step(Pose3::Identity(), kStep_s)));
  EXPECT_EQ(dut.goal()->position_W_m, Vec3(2, 0, 0));
  dut.Follow({});
  EXPECT_TRUE(is_stop(dut.Step(Pose3::Identity(), kStep_s)));
}

TEST(PathFollowerTest, HoldsASingleWaypoint) {
  Flight flight;
  const Waypoint there{{0.5, -0.5, 0.2}, -3};
  flight.follower.Follow({there});
  EXPECT_TRUE(flight.follower.TargetAtEnd());
  flight.Run(60);
  EXPECT_TRUE(flight.IsAt(there));
}

TEST(PathFollowerTest, TakesWaypointsTwiceAndNoTime) {
  Flight flight;
  const Waypoint there{{0.5, 0, 0}, 0};
  flight.follower.Follow({{}, {}, there, there, there});
  EXPECT_TRUE(flight.follower.Step(flight.X_WB, 0).velocity_B_m_s.allFinite());
  flight.Run(20);
  EXPECT_TRUE(flight.IsAt(there));
}

}  // namespace
}  // namespace vog
