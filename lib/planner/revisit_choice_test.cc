#include "lib/planner/revisit_choice.h"

#include <gtest/gtest.h>

#include "lib/planner/chamber_testing.h"

namespace vog {
namespace {

constexpr double kShare = 0.15;
const Waypoint kAt{{-2, 1, 0}, 0.4};
const FlightTime kLate{1000, 0, 10};

class RevisitChoiceTest : public testing::Test {
 protected:
  RevisitChoiceTest() {
    checker_.SetPresence(kAt, kChamberVoxel_m);
    routes_.Search(map_, checker_, kAt);
  }
  static RevisitPlace PlaceAt(int submap, const Vec3& p_W, double gain) {
    return {submap, {p_W, 1}, {p_W, 1}, gain};
  }
  std::optional<int> Best(const FlightTime& time) {
    const auto best = dut_.Best(routes_, time);
    return best ? std::optional(best->submap) : std::nullopt;
  }

  const GridMap map_ = Chamber();
  const PlannerOptions options_ = SmallPlanner();
  const MotionLimits limits_{0.25, 0.15};
  CollisionChecker checker_{options_.collision_rules()};
  Routes routes_{options_, limits_, ChamberBox()};
  RevisitChoice dut_{kShare, limits_};
};

TEST_F(RevisitChoiceTest, TakesWhatGainsMostForItsTime) {
  EXPECT_FALSE(dut_.IsWorthASearch(kAt, kLate)) << "nothing was offered";
  EXPECT_FALSE(Best(kLate));
  // 20 s of looking, and some 8 and 32 s of way there and back: 2 / 1000 of gain a second.
  dut_.Offer(
      {PlaceAt(3, {-1, 1, 0}, 0.2), PlaceAt(7, {2, 1, 0}, 0.22), PlaceAt(9, {-2, 1, 0}, 0.09)});
  EXPECT_TRUE(dut_.IsWorthASearch(kAt, kLate));
  EXPECT_TRUE(dut_.IsNew());
  EXPECT_EQ(Best(kLate), 3);
  EXPECT_FALSE(dut_.IsNew());
  dut_.LookAgain();
  EXPECT_TRUE(dut_.IsNew());
  dut_.Offer({PlaceAt(3, {-1, 1, 0}, 0.2), PlaceAt(7, {2, 1, 0}, 0.3)});
  EXPECT_EQ(Best(kLate), 7);
  dut_.Offer({PlaceAt(3, {-1, 1, 0}, 0.11)});
  EXPECT_EQ(Best(kLate), 3);
  EXPECT_FALSE(Best({400, 0, 10})) << "too little for its time";
}

TEST_F(RevisitChoiceTest, KeepsToItsShareOfTheTime) {
  dut_.Offer({PlaceAt(3, {-1, 1, 0}, 0.9)});
  EXPECT_FALSE(dut_.IsWorthASearch(kAt, {100, 0, 10})) << "28 of 100 s";
  EXPECT_TRUE(dut_.IsWorthASearch(kAt, {300, 0, 10}));
  EXPECT_FALSE(dut_.IsWorthASearch(kAt, {300, 30, 10}));
  EXPECT_EQ(Best({300, 0, 10}), 3);
  EXPECT_FALSE(Best({300, 30, 10}));
  RevisitChoice off(0, limits_);
  off.Offer({PlaceAt(3, {-1, 1, 0}, 0.9)});
  EXPECT_FALSE(off.IsWorthASearch(kAt, kLate));
}

TEST_F(RevisitChoiceTest, TakesNoPlaceThatItCannotReach) {
  dut_.Offer({PlaceAt(3, {9, 0, 0}, 0.9), PlaceAt(4, {1, 0, 0}, 0.9)});  // The pillar.
  EXPECT_TRUE(dut_.IsWorthASearch(kAt, kLate));
  EXPECT_FALSE(Best(kLate));
}

TEST_F(RevisitChoiceTest, TriesTheSameAgainOnlyMuchLater) {
  dut_.Offer({PlaceAt(3, {-1, 1, 0}, 0.9)});
  dut_.NoteTried(3, kLate);
  EXPECT_FALSE(Best({1200, 0, 10}));
  EXPECT_EQ(Best({1250, 0, 10}), 3);
}

}  // namespace
}  // namespace vog
