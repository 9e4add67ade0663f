#include "sim/world/world.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sim/scene/propeller.h"
#include "sim/scene/shapes.h"
#include "sim/scene/tank.h"

namespace vog {
namespace {

using namespace std::chrono_literals;

/// A wall whose face is the plane y = 5.
TriangleMesh Wall() { return Box(MakePose({0, 6, 0}), {40, 2, 40}); }

WorldSetup SensorsSetup() {
  WorldSetup setup;
  setup.simulation.navigation = NavigationKind::kSensors;
  return setup;
}

/// All numbers of an emission, for comparing runs bit by bit.
std::vector<double> NumbersOf(const Emissions& emissions) {
  std::vector<double> numbers;
  const auto add = [&](const auto& matrix) {
    numbers.insert(numbers.end(), matrix.data(), matrix.data() + matrix.size());
  };
  for (const auto& record : emissions.navigation) {
    add(record.X_OB.matrix());
    add(record.velocity_B_m_s);
  }
  for (const auto& record : emissions.dvl) add(record.velocity_B_m_s);
  for (const auto& record : emissions.imu) add(record.angular_velocity_B_rad_s);
  for (const auto& record : emissions.depth) numbers.push_back(record.depth_m);
  for (const auto& record : emissions.truth) add(record.X_WB.matrix());
  for (const auto& record : emissions.sonar_returns)
    numbers.insert(numbers.end(), record.range_m.begin(), record.range_m.end());
  for (const auto& record : emissions.sonar_frames)
    numbers.insert(numbers.end(), record.samples.begin(), record.samples.end());
  return numbers;
}

void Append(const Emissions& more, Emissions& all) {
  const auto append = [](const auto& from, auto& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(more.navigation, all.navigation);
  append(more.dvl, all.dvl);
  append(more.imu, all.imu);
  append(more.depth, all.depth);
  append(more.sonar_returns, all.sonar_returns);
  append(more.sonar_frames, all.sonar_frames);
  append(more.truth, all.truth);
}

Emissions Drive(World& dut, Duration step, Duration length) {
  Emissions all;
  for (Time time{}; time <= Time(length); time += step) {
    const double t = ToSeconds(time);
    Append(dut.AdvanceTo(time), all);
    dut.SetCommand({{0.1 * std::sin(0.3 * t), 0.05, 0.02 * std::cos(t)}, 0.1 * std::cos(0.2 * t)});
  }
  return all;
}

std::string ErrorOf(const WorldSetup& setup, const TriangleMesh& scene) {
  try {
    World world(setup, scene);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

template <class Record>
void ExpectRate(const std::vector<Record>& records, Duration period, Duration length) {
  ASSERT_EQ(static_cast<std::int64_t>(records.size()), length / period + 1);
  for (std::size_t i = 0; i < records.size(); ++i)
    ASSERT_EQ(records[i].time, Time(static_cast<std::int64_t>(i) * period)) << i;
}

template <class Record>
void ExpectSequence(const std::vector<Record>& records) {
  for (std::size_t i = 0; i < records.size(); ++i)
    ASSERT_EQ(records[i].sequence, static_cast<std::int64_t>(i));
}

TEST(WorldTest, EmitsWhatIsDueAtTimeZero) {
  World dut({}, Wall());
  const Emissions first = dut.AdvanceTo(Time{});
  EXPECT_EQ(first.navigation.size(), 1u);
  EXPECT_EQ(first.truth.size(), 1u);
  EXPECT_EQ(first.sonar_returns.size(), 1u);
  EXPECT_TRUE(first.dvl.empty());
  EXPECT_TRUE(first.sonar_frames.empty());
  EXPECT_EQ(dut.next_due(), Time(100ms));
  EXPECT_TRUE(NumbersOf(dut.AdvanceTo(Time(99ms))).empty());
  EXPECT_EQ(dut.AdvanceTo(Time(100ms)).navigation.size(), 1u);
}

TEST(WorldTest, ALaterFlightGoesOnInTimeAndHasNoiseOfItsOwn) {
  WorldSetup setup;
  World first(setup, Wall());
  setup.simulation.start_time_s = 1000;
  World later(setup, Wall());
  EXPECT_EQ(later.next_due(), Time(1000s));
  const Emissions a = first.AdvanceTo(Time(10s)), b = later.AdvanceTo(Time(1010s));
  ASSERT_EQ(a.navigation.size(), b.navigation.size());
  for (std::size_t i = 0; i < a.navigation.size(); ++i) {
    EXPECT_EQ(b.navigation[i].time - a.navigation[i].time, Duration(1000s));
    // With one seed; the seed of the missions' simulator differs by flight.
    EXPECT_EQ(a.navigation[i].X_OB.matrix(), b.navigation[i].X_OB.matrix());
  }
  const std::uint64_t seed = NoiseSeed(1, Time(1000s));
  EXPECT_EQ(NoiseSeed(1, Time{}), 1u);
  EXPECT_NE(seed, 1u);
  EXPECT_NE(seed, NoiseSeed(1, Time(1001s)));
  EXPECT_NE(seed, NoiseSeed(2, Time(1000s)));
}

TEST(WorldTest, Eq8KeepsItsRatesAndOrder) {
  World dut({}, Wall());
  const Emissions all = Drive(dut, 100ms, 10s);
  ExpectRate(all.navigation, 100ms, 10s);
  ExpectRate(all.truth, 100ms, 10s);
  ExpectRate(all.sonar_returns, 200ms, 10s);
  ExpectSequence(all.navigation);
  ExpectSequence(all.sonar_returns);
}

TEST(WorldTest, SensorsKeepTheirRatesAndOrder) {
  WorldSetup setup = SensorsSetup();
  setup.sonar_model.emits = SonarOutput::kFrames;
  World dut(setup, Wall());
  const Emissions all = Drive(dut, 50ms, 4s);
  ASSERT_EQ(all.navigation.size(), 1u);  // The fix to start from.
  EXPECT_EQ(all.navigation[0].time, Time{});
  EXPECT_TRUE(all.sonar_returns.empty());
  ExpectRate(all.dvl, 200ms, 4s);
  ExpectRate(all.imu, 50ms, 4s);
  ExpectRate(all.depth, 100ms, 4s);
  ExpectRate(all.truth, 100ms, 4s);
  ExpectRate(all.sonar_frames, 200ms, 4s);
  ExpectSequence(all.dvl);
  ExpectSequence(all.imu);
  ExpectSequence(all.depth);
  ExpectSequence(all.sonar_frames);
}

// The readers interpolate the navigation at each scan: there it shall be exact.
TEST(WorldTest, NavigationAndTruthAreThereAtEachScan) {
  WorldSetup setup;
  setup.sonar.rate_hz = 3;
  setup.simulation.nav_rate_hz = 4;
  World dut(setup, Wall());
  const Emissions all = dut.AdvanceTo(Time(5s));
  EXPECT_EQ(all.sonar_returns.size(), 16u);
  ASSERT_EQ(all.navigation.size(), all.truth.size());
  for (std::size_t i = 0; i < all.truth.size(); ++i) {
    EXPECT_EQ(all.navigation[i].time, all.truth[i].time);
    if (i > 0) {
      EXPECT_LT(all.truth[i - 1].time, all.truth[i].time);
    }
  }
  for (const SonarReturns& scan : all.sonar_returns) {
    EXPECT_TRUE(std::any_of(all.navigation.begin(), all.navigation.end(),
                            [&](const auto& record) { return record.time == scan.time; }));
  }
  ExpectSequence(all.navigation);
}

TEST(WorldTest, EqualRunsGiveEqualBits) {
  for (const NavigationKind kind : {NavigationKind::kEq8, NavigationKind::kSensors}) {
    WorldSetup setup;
    setup.simulation.navigation = kind;
    setup.current.sigma_m_s = 0.1;
    World a(setup, Wall()), b(setup, Wall());
    setup.seed = 2;
    World c(setup, Wall());
    const std::vector<double> numbers = NumbersOf(Drive(a, 50ms, 20s));
    EXPECT_EQ(numbers, NumbersOf(Drive(b, 50ms, 20s)));
    EXPECT_NE(numbers, NumbersOf(Drive(c, 50ms, 20s)));
  }
}

// With one command, how the time is cut into calls does not matter.
TEST(WorldTest, LongAndShortAdvancesAgree) {
  WorldSetup setup;
  setup.current.sigma_m_s = 0.1;
  World a(setup, Wall()), b(setup, Wall());
  a.SetCommand({{0.1, 0, 0}, 0.05});
  b.SetCommand({{0.1, 0, 0}, 0.05});
  Emissions stepwise;
  for (Time time{}; time <= Time(10s); time += 100ms) Append(a.AdvanceTo(time), stepwise);
  EXPECT_EQ(NumbersOf(stepwise), NumbersOf(b.AdvanceTo(Time(10s))));
}

TEST(WorldTest, HoldsItsPlaceUntilCommanded) {
  WorldSetup setup;
  setup.vehicle.command_timeout_s = 60;
  World dut(setup, Wall());
  dut.AdvanceTo(Time(10s));
  const TruthRecord before = dut.AdvanceTo(Time(10100ms)).truth.back();
  EXPECT_LT((before.X_WB.translation() - Vec3(0, -3, 0)).norm(), 1e-9);
  dut.SetCommand({{0.2, 0, 0}, 0});  // Along +y, where it looks.
  const TruthRecord after = dut.AdvanceTo(Time(20100ms)).truth.back();
  EXPECT_NEAR(after.X_WB.translation().y(), -3 + 0.2 * 9.4, 0.1);
  EXPECT_NEAR(after.velocity_B_m_s.x(), 0.2, 0.005);
}

TEST(WorldTest, StopsByItselfWhenCommandsCease) {
  WorldSetup setup;
  setup.vehicle.command_timeout_s = 2;
  World dut(setup, Wall());
  dut.SetCommand({{0.2, 0, 0}, 0});
  EXPECT_GT(dut.AdvanceTo(Time(1900ms)).truth.back().velocity_B_m_s.x(), 0.1);
  EXPECT_LT(dut.AdvanceTo(Time(12s)).truth.back().velocity_B_m_s.norm(), 0.01);
}

TEST(WorldTest, TellsTheCurrentThatItHas) {
  WorldSetup setup;
  setup.current.mean_m_s = {0.1, 0.05, 0};
  World dut(setup, Wall());
  EXPECT_EQ(dut.AdvanceTo(Time(1s)).truth.back().current_W_m_s, Vec3(0.1, 0.05, 0));
}

// From (1, 0.5, 0), looking along +x: the wall's face is inner_m from the tank's axis.
TEST(WorldTest, SonarSeesTheTanksWall) {
  WorldSetup setup;
  setup.simulation.start_position_m = {1, 0.5, 0.3};
  setup.simulation.start_yaw_deg = 0;
  setup.sonar.tilt = TiltMode::kFixed;
  setup.sonar.mount_m = {0.1, 0, 0};
  setup.sonar_model.range_noise_m = setup.sonar_model.miss_probability = 0;
  setup.sonar_model.false_return_probability = setup.sonar_model.crosstalk_probability = 0;
  setup.sonar_model.double_bounce_probability = 0;
  World dut(setup, GenerateTank({}));
  const SonarReturns returns = dut.AdvanceTo(Time{}).sonar_returns.at(0);
  const double inner_m = 0.5 * TankOptions{}.diameter_m - TankOptions{}.wall_thickness_m;
  const Eigen::Vector2d from(1.1, 0.5);
  const std::vector<double> bearings = BeamBearings(setup.sonar);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Eigen::Vector2d along(std::cos(bearings[i]), std::sin(bearings[i]));
    const double b = from.dot(along);
    const double range_m = -b + std::sqrt(b * b + inner_m * inner_m - from.squaredNorm());
    EXPECT_NEAR(returns.range_m[i], range_m, 0.015) << i;
  }
}

TEST(WorldTest, RefusesAnEmptyScene) {
  EXPECT_EQ(ErrorOf({}, TriangleMesh{}), "the scene has no triangles");
}

TEST(WorldTest, RefusesToStartInTheStructure) {
  WorldSetup setup;
  setup.simulation.start_position_m = {0, 6, 0};  // Deep in the wall, no face near.
  EXPECT_TRUE(ErrorOf(setup, Box(MakePose({0, 6, 0}), {40, 4, 40}))
                  .starts_with("the vehicle would start inside an obstacle at (0, 6, 0)"));
  setup.simulation.start_position_m = {0, 4.6, 0};
  EXPECT_TRUE(ErrorOf(setup, Wall()).starts_with("the vehicle would start inside an obstacle"));
  setup.simulation.start_position_m = {0, 4.45, 0};
  EXPECT_EQ(ErrorOf(setup, Wall()), "no error");
  setup.simulation.start_yaw_deg = 45;  // Now a corner reaches it.
  EXPECT_NE(ErrorOf(setup, Wall()), "no error");
}

TEST(WorldTest, StartsBesideThePropeller) {
  EXPECT_EQ(ErrorOf({}, GeneratePropeller({})), "no error");
  WorldSetup setup;
  setup.simulation.start_position_m = {0.3, -1.9, 0};
  EXPECT_NE(ErrorOf(setup, GeneratePropeller({})), "no error");
}

TEST(WorldOptionsTest, ReadsItsTable) {
  const Config config =
      Config::Parse("[simulation]\nstart_position_m = [1, 2, 3]\nnavigation = 'sensors'", "w.toml");
  const auto options = config.Read<WorldOptions>("simulation");
  EXPECT_EQ(options.start_position_m, Vec3(1, 2, 3));
  EXPECT_EQ(options.navigation, NavigationKind::kSensors);
}

}  // namespace
}  // namespace vog
