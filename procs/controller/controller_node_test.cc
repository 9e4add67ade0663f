#include "procs/controller/controller_node.h"

#include <gtest/gtest.h>

#include "procs/map_service/node_testing.h"

namespace vog {
namespace {

class ControllerNodeTest : public testing::Test {
 protected:
  ControllerNodeTest() {
    settings_.run_id = Bench::kRun;
    Start();
  }

  void Start() {
    dut_.reset();
    dut_ = std::make_unique<Process<ControllerNode>>(bench_.queue, ++epoch_, settings_);
  }

  static Time At(int tick) { return Time(tick * Duration(100000)); }
  static plan_t PlanOf(std::int64_t id, const std::vector<Waypoint>& path) {
    plan_t plan{};
    plan.plan_id = id;
    plan.waypoints = static_cast<int>(path.size());
    for (const Waypoint& waypoint : path) {
      waypoint_t point{};
      std::copy_n(waypoint.position_W_m.data(), 3, point.position_m);
      point.yaw_rad = waypoint.yaw_rad;
      plan.path.push_back(point);
    }
    return plan;
  }
  void SayPlan(const plan_t& plan) {
    bench_.Say(outputs::kPlan, plan, bench_.queue.now());
    bench_.RunFor(Duration(0));
  }
  VelocityCommand CommandFor(const Pose3& X_WB, int tick, const Pose3& X_WO = Pose3::Identity()) {
    pose_estimate_t pose{};
    pose.X_WB = ToMessage(X_WB);
    pose.X_WO = ToMessage(X_WO);
    bench_.Say(outputs::kPose, pose, At(tick));
    bench_.RunUntil(At(tick));
    const control_t control = bench_.Last(outputs::kControl);
    EXPECT_EQ(TimeOf(control.header), At(tick));
    return *FromMessage(control);
  }

  Bench bench_;
  ControllerSettings settings_;
  std::unique_ptr<Process<ControllerNode>> dut_;
  std::int64_t epoch_ = 10;
  const std::vector<Waypoint> path_ = {{}, {{2, 0, 0}, 0.5}, {{2, 2, 0}, -1}};
};

bool IsStop(const VelocityCommand& command) {
  return command.velocity_B_m_s.isZero() && command.yaw_rate_rad_s == 0;
}

TEST_F(ControllerNodeTest, FliesThePlanAsThePathFollowerDoes) {
  PathFollower expected(settings_.controller);
  SayPlan(PlanOf(1, path_));
  expected.Follow(path_);
  Pose3 X_WB = Pose3::Identity();
  for (int tick = 1; tick < 300; ++tick) {
    if (tick % 10 == 0) SayPlan(PlanOf(1, path_));  // Told again for those who come late.
    const VelocityCommand command = CommandFor(X_WB, tick);
    const VelocityCommand same = expected.Step(X_WB, tick == 1 ? 0 : 0.1);
    ASSERT_TRUE(command.velocity_B_m_s.isApprox(same.velocity_B_m_s, 1e-9)) << tick;
    ASSERT_NEAR(command.yaw_rate_rad_s, same.yaw_rate_rad_s, 1e-9);
    X_WB = X_WB * MakePose(0.1 * command.velocity_B_m_s, {0, 0, 0.1 * command.yaw_rate_rad_s});
  }
  EXPECT_LT((X_WB.translation() - path_.back().position_W_m).norm(), 0.05);
  EXPECT_EQ(bench_.Said(outputs::kControl).size(), 299u) << "one for each pose";
}

TEST_F(ControllerNodeTest, WithoutAPlanTheVehicleStops) {
  EXPECT_TRUE(IsStop(CommandFor(MakePose({1, 2, 3}), 1)));
  bench_.RunUntil(At(15));
  EXPECT_EQ(bench_.StatusOf("vog-controller").health, "waiting for a plan");
  EXPECT_EQ(bench_.Said(outputs::kControl).size(), 1u) << "and without a pose it says nothing";
}

TEST_F(ControllerNodeTest, ANewPlanReplacesTheOld) {
  SayPlan(PlanOf(1, path_));
  CommandFor(Pose3::Identity(), 1);
  EXPECT_GT(CommandFor(Pose3::Identity(), 2).velocity_B_m_s.x(), 0.1);
  SayPlan(PlanOf(2, {{}, {{-2, 0, 0}, 0}}));
  EXPECT_LT(CommandFor(Pose3::Identity(), 3).velocity_B_m_s.x(), -0.1);
  SayPlan(PlanOf(3, {}));
  EXPECT_TRUE(IsStop(CommandFor(Pose3::Identity(), 4)));
}

TEST_F(ControllerNodeTest, APlannerThatRestartedCountsAnew) {
  SayPlan(PlanOf(7, path_));
  bench_.epoch += 1;
  SayPlan(PlanOf(7, {{}, {{-2, 0, 0}, 0}}));
  CommandFor(Pose3::Identity(), 1);
  EXPECT_LT(CommandFor(Pose3::Identity(), 2).velocity_B_m_s.x(), -0.1);
  // What is left of the old one is stale.
  bench_.epoch -= 1;
  SayPlan(PlanOf(8, path_));
  bench_.epoch += 1;
  EXPECT_LT(CommandFor(Pose3::Identity(), 3).velocity_B_m_s.x(), -0.1);
}

TEST_F(ControllerNodeTest, AfterItsOwnRestartItStopsUntilThePlanIsToldAgain) {
  SayPlan(PlanOf(1, path_));
  CommandFor(Pose3::Identity(), 1);
  Start();
  EXPECT_TRUE(IsStop(CommandFor(Pose3::Identity(), 2)));
  SayPlan(PlanOf(1, path_));
  CommandFor(Pose3::Identity(), 3);
  EXPECT_FALSE(IsStop(CommandFor(Pose3::Identity(), 4)));
}

TEST_F(ControllerNodeTest, APathInTheOdometrysWorldIsFlownThere) {
  plan_t plan = PlanOf(1, {{}, {{2, 0, 0}, 0}});
  plan.in_odometry_frame = true;
  SayPlan(plan);
  const Pose3 X_WO = MakePose({5, -3, 1}, {0, 0, 2});
  CommandFor(X_WO, 1, X_WO);
  const VelocityCommand command = CommandFor(X_WO, 2, X_WO);
  EXPECT_TRUE(command.velocity_B_m_s.isApprox(Vec3(0.25, 0, 0), 1e-6));
}

TEST_F(ControllerNodeTest, TheTargetDoesNotLeapAfterAGap) {
  SayPlan(PlanOf(1, {{}, {{10, 0, 0}, 0}}));
  CommandFor(Pose3::Identity(), 1);
  CommandFor(Pose3::Identity(), 600);  // A minute later the target is half a second ahead.
  // One step on, where the target is at 0.5 s + 0.1 s: its speed, and the gain on the lag.
  const double lag_m = 0.25 * 0.6;
  EXPECT_LE(lag_m, settings_.controller.max_lag_m);
  const VelocityCommand behind = CommandFor(MakePose({lag_m + 0.2, 0, 0}), 601);
  EXPECT_NEAR(behind.velocity_B_m_s.x(), 0.25 - 0.5 * 0.2, 1e-6);
}

TEST_F(ControllerNodeTest, TimeThatRunsBackwardsIsNoTime) {
  SayPlan(PlanOf(1, path_));
  CommandFor(Pose3::Identity(), 10);
  pose_estimate_t pose{};
  pose.X_WB = pose.X_WO = ToMessage(Pose3::Identity());
  pose.header = bench_.NextHeader(outputs::kPose.name, At(5));
  bench_.SayAsIs(outputs::kPose, pose, bench_.queue.now());
  bench_.RunFor(Duration(0));
  const auto command = FromMessage(bench_.Last(outputs::kControl));
  ASSERT_TRUE(command.has_value());
  EXPECT_LE(command->velocity_B_m_s.norm(), settings_.controller.max_speed_m_s + 1e-9);
}

TEST_F(ControllerNodeTest, ImpossibleValuesAreCountedAndTheOldPlanIsFlownOn) {
  SayPlan(PlanOf(1, path_));
  SayPlan(PlanOf(2, {{}, {{std::numeric_limits<double>::quiet_NaN(), 0, 0}, 0}}));
  SayPlan(PlanOf(3, {{}, {{0, 0, 0}, std::numeric_limits<double>::infinity()}}));
  CommandFor(Pose3::Identity(), 1);
  EXPECT_GT(CommandFor(Pose3::Identity(), 2).velocity_B_m_s.x(), 0.1);
  pose_estimate_t pose{};  // No rotation.
  bench_.Say(outputs::kPose, pose, At(3));
  bench_.RunUntil(At(20));
  EXPECT_EQ(bench_.Said(outputs::kControl).size(), 2u);
  EXPECT_EQ(bench_.CounterOf("vog-controller", "malformed"), 3);
}

TEST_F(ControllerNodeTest, DamagedBytesAreCountedAndHarmless) {
  SayPlan(PlanOf(1, path_));
  CommandFor(Pose3::Identity(), 1);
  Random random(1, "damage");
  int damaged = SayDamaged(bench_, outputs::kPlan, PlanOf(2, path_), random);
  damaged += SayDamaged(bench_, outputs::kPose, pose_estimate_t{}, random);
  EXPECT_GT(CommandFor(Pose3::Identity(), 3).velocity_B_m_s.x(), 0.1);
  bench_.RunUntil(At(20));
  EXPECT_EQ(bench_.CounterOf("vog-controller", "malformed") +
                bench_.CounterOf("vog-controller", "other_run"),
            damaged);
}

}  // namespace
}  // namespace vog
