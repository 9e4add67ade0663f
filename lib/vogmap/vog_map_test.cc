#include "lib/vogmap/vog_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "lib/occupancy/answers_testing.h"
#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;
// Where the submaps of these tests lie.
constexpr double kHalfSide_m = 0.8;

/// The VOG-map by the letter of eq. 2-5: no cache, no bricks, no boxes.
struct LiteralMap {
  struct Part {
    VoxelTable voxels;
    Pose3 X_WM;
    double sigma_m = 0;
  };

  static std::optional<int> UnitsAt(const Part& part, const Vec3& p_W) {
    const Vec3 p_M = part.X_WM.inverse() * p_W;
    const auto index = [](double x) { return static_cast<int>(std::floor(1 / kVoxel_m * x)); };
    const auto found = part.voxels.find({index(p_M.x()), index(p_M.y()), index(p_M.z())});
    return found == part.voxels.end() ? std::nullopt : std::optional(found->second);
  }

  float LogOddsAt(const Vec3& p_W) const {
    int sum = 0;
    bool is_known = false;
    const auto add = [&](const Part& part) {
      const auto units = UnitsAt(part, p_W);
      sum += units.value_or(0);
      is_known |= units.has_value();
    };
    for (const auto& [id, part] : submaps) add(part);
    if (open) add(*open);
    const int clamped = std::min<int>(std::max<int>(sum, model.min), model.max);
    return is_known ? static_cast<float>(clamped / 32.0) : std::nanf("");
  }

  double SigmaAt(const Vec3& p_W) const {
    const auto is_occupied = [&](const Part& part) {
      const auto units = UnitsAt(part, p_W);
      return units && *units >= model.occupied_from;
    };
    if (open && is_occupied(*open)) return sigma_since_m;
    std::optional<double> least_m;
    for (const auto& [id, part] : submaps) {
      if (is_occupied(part)) least_m = std::min(least_m.value_or(1e9), part.sigma_m);
    }
    return least_m ? std::sqrt(*least_m * *least_m + sigma_since_m * sigma_since_m) : 0;
  }

  SensorModel model{SensorModelOptions{}};
  std::map<SubmapId, Part> submaps;
  std::optional<Part> open;
  double sigma_since_m = 0;
};

VoxelKey RandomVoxel(Random& random) {
  const int half_side = static_cast<int>(2 * kHalfSide_m / kVoxel_m);
  const auto index = [&] { return random.Index(2 * half_side) - half_side; };
  const int x = index(), y = index();
  return {x, y, index()};
}

/// A map and the literal one, which get the same changes.
class VogMapTest : public testing::Test {
 protected:
  void Place(SubmapId id) {
    const SubmapPtr submap = RandomSubmap(id, kVoxel_m, random_);
    const Pose3 X_WM = RandomPose(kHalfSide_m, random_);
    const double sigma_m = dut_.Has(id) ? literal_.submaps[id].sigma_m : 0;
    dut_.Place(submap, X_WM);
    literal_.submaps[id] = {TableOf(submap->grid), X_WM, sigma_m};
  }

  void Move(const std::vector<SubmapId>& ids) {
    std::vector<std::pair<SubmapId, Pose3>> poses_WM;
    for (const SubmapId id : ids) {
      poses_WM.emplace_back(id, RandomPose(kHalfSide_m, random_));
      if (literal_.submaps.count(id)) literal_.submaps[id].X_WM = poses_WM.back().second;
    }
    dut_.Move(poses_WM);
  }

  void Remove(SubmapId id) {
    dut_.Remove(id);
    literal_.submaps.erase(id);
  }

  void SetOpen() {
    open_ = GridOf(kVoxel_m, RandomTable(500, 8, random_));
    const Pose3 X_WM = RandomPose(kHalfSide_m, random_);
    dut_.SetOpen(&open_, X_WM);
    literal_.open = {TableOf(open_), X_WM};
  }

  void GrowOpen() {
    for (int i = 0; i < 100; ++i) {
      const auto index = [&] { return random_.Index(16) - 8; };
      open_.At({index(), index(), index()}) = static_cast<LogOddsUnits>(random_.Index(100) - 50);
    }
    dut_.NoteOpenGrew();
    literal_.open->voxels = TableOf(open_);
  }

  /// Each way to ask at `count` random places: returns how many answers were known.
  int ExpectLiteralAnswers(int count) {
    int known = 0;
    for (int i = 0; i < count; ++i) {
      const Vec3 p_W = RandomPoint(2 * kHalfSide_m, random_);
      const VoxelKey voxel = RandomVoxel(random_);
      const Vec3 center_W = dut_.grid().CenterOf(voxel);
      float at_point, at_center, of_voxel;
      dut_.LogOddsAt({&p_W, 1}, {&at_point, 1});
      dut_.LogOddsAt({&center_W, 1}, {&at_center, 1});
      dut_.LogOddsOf({&voxel, 1}, {&of_voxel, 1});
      EXPECT_PRED2(IsSameAnswer, at_point, literal_.LogOddsAt(p_W)) << p_W.transpose();
      EXPECT_PRED2(IsSameAnswer, at_center, literal_.LogOddsAt(center_W)) << center_W.transpose();
      EXPECT_PRED2(IsSameAnswer, of_voxel, at_center) << center_W.transpose();
      known += IsKnown(at_point) + IsKnown(of_voxel);
    }
    return known;
  }

  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  LiteralMap literal_;
  VogMap dut_{kVoxel_m, literal_.model};
  BrickGrid open_{kVoxel_m};
};

TEST_F(VogMapTest, KnowsNothingWithoutSubmaps) {
  EXPECT_EQ(ExpectLiteralAnswers(50), 0);
  EXPECT_TRUE(dut_.Bounds().isEmpty());
  EXPECT_EQ(dut_.size(), 0);
  EXPECT_EQ(dut_.max_sigma_m(), 0);
}

TEST_F(VogMapTest, AnswersAreTheClampedSumOverAllSubmaps) {
  for (int id = 0; id < 12; ++id) Place(id);
  EXPECT_GT(ExpectLiteralAnswers(2000), 1000);
}

TEST_F(VogMapTest, FollowsEveryChange) {
  for (int id = 0; id < 5; ++id) Place(id);
  SetOpen();
  int known = 0;
  for (int change = 0; change < 60; ++change) {
    const std::int64_t revision = dut_.revision();
    switch (random_.Index(6)) {
      case 0:
        Place(random_.Index(8));
        break;
      case 1:
        Move({random_.Index(8), random_.Index(8)});
        break;
      case 2:
        Move(dut_.ids());
        break;
      case 3:
        Remove(random_.Index(8));
        break;
      case 4:
        SetOpen();
        break;
      default:
        GrowOpen();
    }
    EXPECT_GT(dut_.revision(), revision);
    known += ExpectLiteralAnswers(60);
  }
  EXPECT_GT(known, 1000);
  dut_.SetOpen(nullptr, Pose3::Identity());
  literal_.open.reset();
  ExpectLiteralAnswers(200);
}

// Few changes among many submaps: the sums are corrected, not made anew.
TEST_F(VogMapTest, FollowsFewChangesAmongMany) {
  for (int id = 0; id < 40; ++id) Place(id);
  int known = ExpectLiteralAnswers(3000);
  for (int change = 0; change < 40; ++change) {
    const int kind = random_.Index(8);
    if (kind == 0) Remove(random_.Index(44));
    if (kind == 1) Place(random_.Index(44));
    if (kind == 2) SetOpen();
    if (kind == 3 && literal_.open) GrowOpen();
    if (kind >= 4) Move({random_.Index(44), random_.Index(44), random_.Index(44)});
    // Blocks are asked after one change, after several, and never.
    if (random_.Index(3) > 0) known += ExpectLiteralAnswers(300);
  }
  EXPECT_GT(known, 5000);
}

TEST_F(VogMapTest, TellsWhereItHasChanged) {
  for (int id = 0; id < 6; ++id) Place(id);
  SetOpen();
  int unchanged = 0, changed = 0;
  for (int round = 0; round < 40; ++round) {
    std::map<VoxelKey, float> before;
    for (int i = 0; i < 200; ++i) {
      const VoxelKey voxel = RandomVoxel(random_);
      before[voxel] = literal_.LogOddsAt(dut_.grid().CenterOf(voxel));
    }
    const std::int64_t revision = dut_.revision();
    for (int i = random_.Index(3); i >= 0; --i) {
      const int kind = random_.Index(5);
      if (kind == 0) Place(random_.Index(8));
      if (kind == 1) Move({random_.Index(8)});
      if (kind == 2) Remove(random_.Index(8));
      if (kind == 3) SetOpen();
      if (kind == 4) GrowOpen();
    }
    const auto boxes_W = dut_.ChangedSince(revision);
    ASSERT_TRUE(boxes_W.has_value());
    for (const auto& [voxel, log_odds] : before) {
      const Vec3 center_W = dut_.grid().CenterOf(voxel);
      const bool may_have = std::any_of(boxes_W->begin(), boxes_W->end(), [&](const auto& box_W) {
        return box_W.contains(center_W);
      });
      changed += may_have;
      unchanged += !may_have;
      if (!may_have) {
        EXPECT_PRED2(IsSameAnswer, literal_.LogOddsAt(center_W), log_odds);
      }
    }
  }
  EXPECT_GT(changed, 100);
  EXPECT_GT(unchanged, 100);
  EXPECT_TRUE(dut_.ChangedSince(dut_.revision())->empty());
  for (int i = 0; i < 6000; ++i) Move({i % 8});
  EXPECT_FALSE(dut_.ChangedSince(0).has_value());
}

TEST_F(VogMapTest, AnOpenSubmapThatGrowsHasChangedOneBox) {
  SetOpen();
  const std::int64_t revision = dut_.revision();
  for (int i = 0; i < 100; ++i) GrowOpen();
  const auto boxes_W = dut_.ChangedSince(revision);
  ASSERT_TRUE(boxes_W.has_value());
  EXPECT_EQ(boxes_W->size(), 1u);
  EXPECT_TRUE(boxes_W->front().contains(dut_.Bounds()));
}

TEST_F(VogMapTest, WhatIsNotFreeInABox) {
  for (int id = 0; id < 6; ++id) Place(id);
  SetOpen();
  std::vector<VoxelAnswer> not_free;
  for (int i = 0; i < 200; ++i) {
    const VoxelKey a = RandomVoxel(random_);
    const VoxelBox box{a,
                       {a.x + random_.Index(20), a.y + random_.Index(9), a.z + random_.Index(9)}};
    dut_.NotFreeIn(box, not_free);
    std::map<VoxelKey, float> expected;
    ForEachVoxel(box, [&](const VoxelKey& voxel) {
      const float log_odds = literal_.LogOddsAt(dut_.grid().CenterOf(voxel));
      if (!(log_odds < 0)) expected[voxel] = log_odds;
    });
    ASSERT_EQ(not_free.size(), expected.size());
    for (const VoxelAnswer& voxel : not_free) {
      ASSERT_EQ(expected.count(voxel.key), 1u);
      EXPECT_PRED2(IsSameAnswer, voxel.log_odds, expected[voxel.key]);
    }
    if (i == 100) GrowOpen();
  }
}

TEST_F(VogMapTest, ViewsSeeAndRaysHitWhatIsCast) {
  constexpr double kMinRange_m = 0.4, kRange_m = 2;
  for (int id = 0; id < 6; ++id) Place(id);
  int hits = 0;
  int ended_early = 0;
  std::size_t unknown = 0;
  for (int view = 0; view < 40; ++view) {
    // Also from where voxels have no short keys.
    const Vec3 far_W = view % 10 == 9 ? Vec3(3e5, 0, 0) : Vec3::Zero();
    const Vec3 origin_W = far_W + RandomPoint(kHalfSide_m, random_);
    std::vector<Vec3> directions_W;
    std::vector<RayVoxel> ray;
    const auto ends = [&](const VoxelKey& key) { return (key.x + key.y + key.z) % 9 == view % 9; };
    std::vector<VoxelKey> expected, expected_ended, seen = {{1, 2, 3}};  // That is replaced.
    for (int i = 0; i < view; ++i) {
      directions_W.push_back(RandomPoint(1, random_).normalized());
      dut_.CastRay(origin_W, directions_W.back(), kRange_m, ray);
      bool has_ended = false;
      for (const RayVoxel& voxel : ray) {
        EXPECT_PRED2(IsSameAnswer, voxel.log_odds,
                     literal_.LogOddsAt(dut_.grid().CenterOf(voxel.key)));
        if (IsKnown(voxel.log_odds) || voxel.entered_m < kMinRange_m) continue;
        expected.push_back(voxel.key);
        if (!has_ended) expected_ended.push_back(voxel.key);
        has_ended |= ends(voxel.key);
      }
      const auto hit = dut_.FirstHit(origin_W, directions_W.back(), kRange_m);
      ASSERT_EQ(hit.has_value(), dut_.IsOccupied(ray.back().log_odds));
      if (hit) {
        EXPECT_EQ(hit->key, ray.back().key);
        EXPECT_EQ(hit->entered_m, ray.back().entered_m);
        ++hits;
      }
    }
    dut_.SeeUnknown(origin_W, directions_W, kMinRange_m, kRange_m, nullptr, seen);
    EXPECT_EQ(seen, expected);
    unknown += seen.size();
    dut_.SeeUnknown(origin_W, directions_W, kMinRange_m, kRange_m, ends, seen);
    EXPECT_EQ(seen, expected_ended);
    ended_early += expected_ended.size() < expected.size();
    if (view == 20) SetOpen();
    if (view > 20) GrowOpen();
  }
  EXPECT_GT(hits, 10);
  EXPECT_GT(unknown, 100u);
  EXPECT_GT(ended_early, 10);
}

TEST_F(VogMapTest, BoxesReadTheSameAsTheirVoxels) {
  for (int id = 0; id < 6; ++id) Place(id);
  SetOpen();
  std::vector<float> box_answers = {1, 2, 3};  // What was there is replaced.
  for (int i = 0; i < 10; ++i) {
    const VoxelKey a = RandomVoxel(random_);
    const VoxelBox box{a,
                       {a.x + random_.Index(20), a.y + random_.Index(20), a.z + random_.Index(12)}};
    dut_.LogOddsIn(box, box_answers);
    ASSERT_EQ(box_answers.size(), box.count());
    ForEachVoxel(box, [&](const VoxelKey& voxel) {
      EXPECT_PRED2(IsSameAnswer, box_answers[box.IndexOf(voxel)],
                   literal_.LogOddsAt(dut_.grid().CenterOf(voxel)));
    });
  }
}

TEST_F(VogMapTest, RaysEndInTheFirstOccupiedVoxelOrAtTheirRange) {
  for (int id = 0; id < 3; ++id) Place(id);
  constexpr double kRange_m = 2.5;
  std::vector<RayVoxel> ray;
  int blocked = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 origin_W = RandomPoint(2 * kHalfSide_m, random_);
    const Vec3 direction_W = RandomPoint(1, random_).normalized();
    dut_.CastRay(origin_W, direction_W, kRange_m, ray);
    ASSERT_FALSE(ray.empty());
    for (std::size_t k = 0; k < ray.size(); ++k) {
      EXPECT_PRED2(IsSameAnswer, ray[k].log_odds,
                   literal_.LogOddsAt(dut_.grid().CenterOf(ray[k].key)));
      // In the middle of its stretch, the ray is in the voxel that it names.
      const double left_m = k + 1 < ray.size() ? ray[k + 1].entered_m : ray[k].entered_m + 1e-5;
      const Vec3 between_W = origin_W + 0.5 * (ray[k].entered_m + left_m) * direction_W;
      if (left_m - ray[k].entered_m > 1e-5) {
        EXPECT_EQ(dut_.grid().KeyOf(between_W), ray[k].key);
      }
      EXPECT_LE(ray[k].entered_m, kRange_m + 1e-6);
      EXPECT_TRUE(k + 1 == ray.size() || !dut_.IsOccupied(ray[k].log_odds));
    }
    EXPECT_EQ(ray.front().entered_m, 0);
    const bool is_blocked = dut_.IsOccupied(ray.back().log_odds);
    blocked += is_blocked;
    if (!is_blocked) {
      EXPECT_EQ(ray.back().key, dut_.grid().KeyOf(origin_W + kRange_m * direction_W));
    }
  }
  EXPECT_GT(blocked, 50);
  EXPECT_LT(blocked, 250);
}

/// Submaps of one voxel each, all on top of each other.
class VogMapSumTest : public VogMapTest {
 protected:
  float SumOf(const std::vector<int>& units) {
    VogMap map(kVoxel_m, literal_.model);
    for (std::size_t id = 0; id < units.size(); ++id)
      map.Place(
          MakeSubmap(static_cast<int>(id), GridOf(kVoxel_m, {{{0, 0, 0}, units[id]}}), random_),
          Pose3::Identity());
    const VoxelKey voxel;
    float log_odds;
    map.LogOddsOf({&voxel, 1}, {&log_odds, 1});
    return log_odds;
  }
};

TEST_F(VogMapSumTest, IsClampedOnceAtTheEnd) {
  const int min = literal_.model.min, max = literal_.model.max;
  EXPECT_EQ(SumOf({max, max, min}), ToLogOdds(max));
  EXPECT_EQ(SumOf({min, max, max}), ToLogOdds(max));
  EXPECT_EQ(SumOf({min, min, max}), ToLogOdds(std::max(min, 2 * min + max)));
  EXPECT_EQ(SumOf(std::vector<int>(300, min)), ToLogOdds(min));
}

TEST_F(VogMapSumTest, OfZeroIsOccupiedAndNotUnknown) {
  EXPECT_EQ(dut_.StateOf(SumOf({20, -20})), VoxelState::kOccupied);
  EXPECT_EQ(dut_.StateOf(SumOf({20, -21})), VoxelState::kFree);
  EXPECT_EQ(dut_.StateOf(SumOf({})), VoxelState::kUnknown);
}

TEST_F(VogMapTest, SigmaIsThatOfTheBestPlacedSubmapThatSeesTheVoxelOccupied) {
  for (int id = 0; id < 8; ++id) Place(id);
  SetOpen();
  std::vector<std::pair<SubmapId, double>> sigmas_m;
  for (int id = 0; id < 7; ++id) {
    literal_.submaps[id].sigma_m = random_.Uniform(0, 0.5);
    sigmas_m.emplace_back(id, literal_.submaps[id].sigma_m);
  }
  sigmas_m.emplace_back(99, 5);  // A number that the map does not hold.
  dut_.SetSigmas(sigmas_m);
  literal_.sigma_since_m = 0.1;
  dut_.SetSigmaSince(0.1);
  Place(3);  // A submap that is replaced keeps its sigma.
  int uncertain = 0;
  for (int i = 0; i < 4000; ++i) {
    if (i == 1000) Place(5);
    if (i == 2000) GrowOpen();
    if (i == 3000) dut_.SetSigmas({{2, literal_.submaps[2].sigma_m = 0.01}});
    const VoxelKey voxel{random_.Index(24) - 12, random_.Index(24) - 12, random_.Index(24) - 12};
    float sigma_m;
    dut_.SigmaOf({&voxel, 1}, {&sigma_m, 1});
    EXPECT_FLOAT_EQ(sigma_m, literal_.SigmaAt(dut_.grid().CenterOf(voxel)));
    EXPECT_LE(sigma_m, dut_.max_sigma_m() + 1e-6);
    uncertain += sigma_m > 0.1f;
  }
  EXPECT_GT(uncertain, 20);
}

TEST_F(VogMapTest, BoundsHoldAllKnownVoxels) {
  for (int id = 0; id < 4; ++id) Place(id);
  SetOpen();
  const auto holds = [&](const LiteralMap::Part& part) {
    const VoxelGrid grid(kVoxel_m);
    Eigen::AlignedBox3d bounds_W = dut_.Bounds();
    bounds_W = {bounds_W.min() - Vec3::Constant(1e-9), bounds_W.max() + Vec3::Constant(1e-9)};
    for (const auto& [key, units] : part.voxels)
      if (!bounds_W.contains(part.X_WM * grid.CenterOf(key))) return false;
    return true;
  };
  for (const auto& [id, part] : literal_.submaps) EXPECT_TRUE(holds(part)) << id;
  EXPECT_TRUE(holds(*literal_.open));
  EXPECT_LT(dut_.Bounds().sizes().maxCoeff(), 2 * (kHalfSide_m + 10 * kVoxel_m * std::sqrt(3)));
}

TEST_F(VogMapTest, TellsWhatItHolds) {
  for (const int id : {4, 2, 9}) Place(id);
  Move({2, 77});
  EXPECT_EQ(dut_.ids(), (std::vector<SubmapId>{2, 4, 9}));
  EXPECT_EQ(dut_.size(), 3);
  EXPECT_TRUE(dut_.Has(4));
  EXPECT_FALSE(dut_.Has(77));
  EXPECT_TRUE(dut_.X_WM(2).isApprox(literal_.submaps[2].X_WM, 0));
  EXPECT_EQ(dut_.submap(9)->id(), 9);
  EXPECT_THROW(dut_.X_WM(77), std::out_of_range);
}

TEST_F(VogMapTest, MayBeMovedFromOnePlaceToAnother) {
  for (int id = 0; id < 6; ++id) Place(id);
  SetOpen();
  ExpectLiteralAnswers(100);
  VogMap moved(std::move(dut_));
  for (int i = 0; i < 500; ++i) {
    const VoxelKey voxel = RandomVoxel(random_);
    float log_odds;
    moved.LogOddsOf({&voxel, 1}, {&log_odds, 1});
    EXPECT_PRED2(IsSameAnswer, log_odds, literal_.LogOddsAt(moved.grid().CenterOf(voxel)));
  }
}

TEST_F(VogMapTest, PlacesFarBeyondTheMapAreUnknown) {
  Place(0);
  for (const double far_m : {1e4, 1e7, 1e8}) {
    const Vec3 p_W(far_m, -far_m, far_m);
    float log_odds;
    dut_.LogOddsAt({&p_W, 1}, {&log_odds, 1});
    EXPECT_FALSE(IsKnown(log_odds));
  }
}

}  // namespace
}  // namespace vog
