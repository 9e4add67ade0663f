#include "lib/occupancy/occupancy_map.h"

#include <gtest/gtest.h>

#include <optional>

#include "lib/baselines/algorithm1.h"
#include "lib/baselines/direct_map.h"
#include "lib/baselines/incremental_merge.h"
#include "lib/baselines/make_submap_map.h"
#include "lib/baselines/standard_map.h"
#include "lib/occupancy/answers_testing.h"
#include "lib/submap/scans_testing.h"
#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/vog_map.h"

/// What all kinds of maps have in common, and how they differ.
namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;
// Where the submaps of these tests lie.
constexpr double kHalfSide_m = 0.8;

Random RandomOfTest() { return {1, testing::UnitTest::GetInstance()->current_test_info()->name()}; }

VoxelKey RandomVoxel(Random& random) {
  return VoxelGrid(kVoxel_m).KeyOf(RandomPoint(2 * kHalfSide_m, random));
}

float AnswerAt(const OccupancyMap& map, const Vec3& p_W) {
  float log_odds;
  map.LogOddsAt({&p_W, 1}, {&log_odds, 1});
  return log_odds;
}

float AnswerOf(const OccupancyMap& map, const VoxelKey& voxel) {
  float log_odds;
  map.LogOddsOf({&voxel, 1}, {&log_odds, 1});
  return log_odds;
}

/// Returns how many of `count` random places are known.
int ExpectSameAnswers(const OccupancyMap& map, const OccupancyMap& other, int count,
                      Random& random) {
  int known = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 p_W = RandomPoint(2 * kHalfSide_m, random);
    const VoxelKey voxel = RandomVoxel(random);
    EXPECT_PRED2(IsSameAnswer, AnswerAt(map, p_W), AnswerAt(other, p_W)) << p_W.transpose();
    EXPECT_PRED2(IsSameAnswer, AnswerOf(map, voxel), AnswerOf(other, voxel));
    known += IsKnown(AnswerOf(map, voxel));
  }
  return known;
}

/// Random submaps that come, move and go, and an open one that grows; maps are told of it.
class SubmapHistory {
 public:
  /// The submaps' log-odds are those of RandomTable() divided by `divisor`.
  explicit SubmapHistory(const Random& random, int divisor = 1)
      : divisor_(divisor), random_(random) {}

  /// Puts all there is into an empty map.
  void ShowTo(SubmapMap& map) const {
    for (const auto& [id, placed] : submaps_) map.Place(placed.first, placed.second);
    map.SetOpen(open_ ? &*open_ : nullptr, X_WM_open_);
  }
  /// The same, and tells each change from now on.
  void Tell(SubmapMap& map) {
    ShowTo(map);
    maps_.push_back(&map);
  }

  void Place(SubmapId id) {
    submaps_[id] = {MakeSubmap(id, RandomGrid(1500, 10), random_),
                    RandomPose(kHalfSide_m, random_)};
    for (SubmapMap* map : maps_) map->Place(submaps_[id].first, submaps_[id].second);
  }
  void Move(const std::vector<SubmapId>& ids) {
    std::vector<std::pair<SubmapId, Pose3>> poses_WM;
    for (const SubmapId id : ids) {
      poses_WM.emplace_back(id, RandomPose(kHalfSide_m, random_));
      if (submaps_.count(id)) submaps_[id].second = poses_WM.back().second;
    }
    for (SubmapMap* map : maps_) map->Move(poses_WM);
  }
  void Remove(SubmapId id) {
    submaps_.erase(id);
    for (SubmapMap* map : maps_) map->Remove(id);
  }
  void SetOpen() {
    open_ = RandomGrid(500, 8);
    X_WM_open_ = RandomPose(kHalfSide_m, random_);
    for (SubmapMap* map : maps_) map->SetOpen(&*open_, X_WM_open_);
  }
  void GrowOpen() {
    for (const auto& [key, units] : TableOf(RandomGrid(100, 8)))
      open_->At(key) = static_cast<LogOddsUnits>(units);
    for (SubmapMap* map : maps_) map->NoteOpenGrew();
  }
  void HideOpen() {
    open_.reset();
    for (SubmapMap* map : maps_) map->SetOpen(nullptr, Pose3::Identity());
  }

  /// @pre SetOpen() was called.
  void ChangeSomething() {
    switch (random_.Index(6)) {
      case 0:
        return Place(random_.Index(8));
      case 1:
        return Move({random_.Index(8), random_.Index(8)});
      case 2:
        return Move({0, 1, 2, 3, 4, 5, 6, 7});
      case 3:
        return Remove(random_.Index(8));
      case 4:
        return SetOpen();
      default:
        GrowOpen();
    }
  }

 private:
  BrickGrid RandomGrid(int voxels, int half_side) {
    VoxelTable table = RandomTable(voxels, half_side, random_);
    for (auto& [key, units] : table) units /= divisor_;
    return GridOf(kVoxel_m, table);
  }

  int divisor_;
  Random random_;
  std::vector<SubmapMap*> maps_;
  std::map<SubmapId, std::pair<SubmapPtr, Pose3>> submaps_;  // At X_WM.
  std::optional<BrickGrid> open_;
  Pose3 X_WM_open_ = Pose3::Identity();
};

// --- all maps ---

template <class Map>
class OccupancyMapTest : public testing::Test {
 protected:
  OccupancyMapTest() {
    if constexpr (std::is_same_v<Map, StandardMap>) {
      for (int i = 0; i < 40; ++i)
        dut_.Insert(RandomScan(FromUtime(i), random_), RandomPose(kHalfSide_m, random_));
    } else {
      for (int id = 0; id < 4; ++id) history_.Place(id);
      history_.SetOpen();
      history_.Tell(dut_);
    }
  }

  static auto ModelOf() {
    if constexpr (std::is_same_v<Map, StandardMap>) {
      return SensorModelOptions{};
    } else {
      return SensorModel(SensorModelOptions{});
    }
  }

  Random random_ = RandomOfTest();
  SubmapHistory history_{random_};
  Map dut_{kVoxel_m, ModelOf()};
};

using AllMaps = testing::Types<VogMap, DirectMap, Algorithm1Map, IncrementalMergeMap, StandardMap>;
TYPED_TEST_SUITE(OccupancyMapTest, AllMaps);

TYPED_TEST(OccupancyMapTest, AVoxelsAnswerIsThatAtItsCentreHoweverItIsAsked) {
  const VoxelBox box{{-16, -16, -3}, {15, 15, 3}};
  std::vector<VoxelKey> voxels;
  std::vector<Vec3> centers_W;
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    voxels.push_back(voxel);
    centers_W.push_back(this->dut_.grid().CenterOf(voxel));
  });
  std::vector<float> in_box = {1, 2, 3};  // What was there is replaced.
  std::vector<float> of_voxels(voxels.size()), at_centers(voxels.size());
  this->dut_.LogOddsIn(box, in_box);
  this->dut_.LogOddsOf(voxels, of_voxels);
  this->dut_.LogOddsAt(centers_W, at_centers);
  ASSERT_EQ(in_box.size(), box.count());
  int known = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    ASSERT_PRED2(IsSameAnswer, of_voxels[i], at_centers[i]);
    ASSERT_PRED2(IsSameAnswer, in_box[box.IndexOf(voxels[i])], at_centers[i]);
    ASSERT_EQ(box.KeyOf(box.IndexOf(voxels[i])), voxels[i]);
    ASSERT_PRED2(IsSameAnswer, AnswerOf(this->dut_, voxels[i]), at_centers[i]) << "asked alone";
    known += IsKnown(at_centers[i]);
  }
  EXPECT_GT(known, 500);
  EXPECT_LT(known, static_cast<int>(voxels.size()));
}

TYPED_TEST(OccupancyMapTest, RaysReadTheirVoxelsUpToTheFirstOccupiedOne) {
  std::vector<RayVoxel> ray;
  int blocked = 0, open = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 origin_W = RandomPoint(2 * kHalfSide_m, this->random_);
    const Vec3 direction_W = RandomPoint(1, this->random_).normalized();
    this->dut_.CastRay(origin_W, direction_W, 1.5, ray);
    std::vector<VoxelKey> expected;
    WalkVoxels(this->dut_.grid(), origin_W, direction_W, 1.5, [&](const VoxelKey& key, double) {
      expected.push_back(key);
      return !this->dut_.IsOccupied(AnswerOf(this->dut_, key));
    });
    ASSERT_EQ(ray.size(), expected.size());
    for (std::size_t k = 0; k < ray.size(); ++k) {
      ASSERT_EQ(ray[k].key, expected[k]);
      ASSERT_PRED2(IsSameAnswer, ray[k].log_odds, AnswerOf(this->dut_, ray[k].key));
    }
    (this->dut_.IsOccupied(ray.back().log_odds) ? blocked : open) += 1;
  }
  EXPECT_GT(blocked, 50);
  EXPECT_GT(open, 50);
}

TYPED_TEST(OccupancyMapTest, PlacesFarAwayAreUnknown) {
  for (const double far_m : {1e3, 1e4, 1e7})
    EXPECT_FALSE(IsKnown(AnswerAt(this->dut_, {far_m, -far_m, far_m})));
}

// --- maps of placed submaps ---

template <class Map>
class SubmapMapTest : public testing::Test {
 protected:
  float AnswerOfSums(const std::vector<int>& units) {
    Map map(kVoxel_m, model_);
    for (std::size_t id = 0; id < units.size(); ++id)
      map.Place(
          MakeSubmap(static_cast<int>(id), GridOf(kVoxel_m, {{{0, 0, 0}, units[id]}}), random_),
          Pose3::Identity());
    return AnswerOf(map, {0, 0, 0});
  }

  Random random_ = RandomOfTest();
  SensorModel model_{SensorModelOptions{}};
  SubmapHistory history_{random_};
  Map dut_{kVoxel_m, model_};
};

using SubmapMaps = testing::Types<VogMap, DirectMap, Algorithm1Map, IncrementalMergeMap>;
TYPED_TEST_SUITE(SubmapMapTest, SubmapMaps);

TYPED_TEST(SubmapMapTest, KnowsNothingWithoutSubmaps) {
  EXPECT_FALSE(IsKnown(AnswerAt(this->dut_, Vec3::Zero())));
  EXPECT_FALSE(IsKnown(AnswerOf(this->dut_, {0, 0, 0})));
  BrickGrid empty(kVoxel_m);
  this->dut_.SetOpen(&empty, Pose3::Identity());
  this->dut_.Place(MakeSubmap(0, BrickGrid(kVoxel_m), this->random_), Pose3::Identity());
  std::vector<RayVoxel> ray;
  this->dut_.CastRay(Vec3::Zero(), Vec3::UnitX(), 1, ray);
  for (const RayVoxel& voxel : ray) EXPECT_FALSE(IsKnown(voxel.log_odds));
}

TYPED_TEST(SubmapMapTest, ASumOfZeroIsOccupiedAndNotUnknown) {
  EXPECT_EQ(this->dut_.StateOf(this->AnswerOfSums({20, -20})), VoxelState::kOccupied);
  EXPECT_EQ(this->dut_.StateOf(this->AnswerOfSums({0})), VoxelState::kOccupied);
  EXPECT_EQ(this->dut_.StateOf(this->AnswerOfSums({20, -21})), VoxelState::kFree);
  EXPECT_EQ(this->dut_.StateOf(this->AnswerOfSums({})), VoxelState::kUnknown);
}

TYPED_TEST(SubmapMapTest, SumsAreClamped) {
  const int min = this->model_.min, max = this->model_.max;
  EXPECT_EQ(this->AnswerOfSums({max, max}), ToLogOdds(max));
  EXPECT_EQ(this->AnswerOfSums(std::vector<int>(300, min)), ToLogOdds(min));
}

TYPED_TEST(SubmapMapTest, OneSubmapShiftedByWholeVoxelsIsThatSubmap) {
  const VoxelTable table = RandomTable(1500, 10, this->random_);
  for (const VoxelKey shift : {VoxelKey{0, 0, 0}, VoxelKey{7, -30, 2}}) {
    const Pose3 X_WM = MakePose(kVoxel_m * Vec3(shift.x, shift.y, shift.z));
    const auto expect_table = [&](const OccupancyMap& map) {
      ForEachVoxel({{-12, -12, -12}, {11, 11, 11}}, [&](const VoxelKey& key) {
        const auto found = table.find(key);
        const float expected = found == table.end() ? kUnknownLogOdds : ToLogOdds(found->second);
        ASSERT_PRED2(IsSameAnswer, expected,
                     AnswerOf(map, {key.x + shift.x, key.y + shift.y, key.z + shift.z}));
      });
    };
    TypeParam closed(kVoxel_m, this->model_), open(kVoxel_m, this->model_);
    const BrickGrid grid = GridOf(kVoxel_m, table);
    closed.Place(MakeSubmap(3, grid, this->random_), X_WM);
    open.SetOpen(&grid, X_WM);
    expect_table(closed);
    expect_table(open);
  }
}

TYPED_TEST(SubmapMapTest, AnswersAreThoseOfAMapThatWasNeverChanged) {
  for (int id = 0; id < 4; ++id) this->history_.Place(id);
  this->history_.SetOpen();
  this->history_.Tell(this->dut_);
  int known = 0;
  for (int change = 0; change < 40; ++change) {
    const std::int64_t revision = this->dut_.revision();
    this->history_.ChangeSomething();
    EXPECT_GT(this->dut_.revision(), revision);
    TypeParam fresh(kVoxel_m, this->model_);
    this->history_.ShowTo(fresh);
    known += ExpectSameAnswers(this->dut_, fresh, 100, this->random_);
  }
  EXPECT_GT(known, 500);
  this->history_.HideOpen();
  TypeParam fresh(kVoxel_m, this->model_);
  this->history_.ShowTo(fresh);
  ExpectSameAnswers(this->dut_, fresh, 200, this->random_);
}

// --- how they differ ---

class MapsSideBySideTest : public testing::Test {
 protected:
  Random random_ = RandomOfTest();
  SensorModel model_{SensorModelOptions{}};
  VogMap vog_{kVoxel_m, model_};
  DirectMap direct_{kVoxel_m, model_};
};

TEST_F(MapsSideBySideTest, DirectIsCachedBitForBit) {
  SubmapHistory history(random_);
  history.SetOpen();
  history.Tell(vog_);
  history.Tell(direct_);
  int known = 0;
  for (int change = 0; change < 100; ++change) {
    history.ChangeSomething();
    known += ExpectSameAnswers(vog_, direct_, 200, random_);
  }
  EXPECT_GT(known, 1000);
}

TEST_F(MapsSideBySideTest, Algorithm1IsEquation5WhereNoPartialSumIsClamped) {
  SubmapHistory history(random_, 9);  // Eight submaps and the open one.
  Algorithm1Map algorithm1(kVoxel_m, model_);
  history.SetOpen();
  history.Tell(algorithm1);
  history.Tell(direct_);
  int known = 0;
  for (int change = 0; change < 50; ++change) {
    history.ChangeSomething();
    known += ExpectSameAnswers(algorithm1, direct_, 200, random_);
  }
  EXPECT_GT(known, 500);
}

TEST_F(MapsSideBySideTest, EachMethodHasItsMap) {
  const auto is = [&]<class Map>(MapMethod method, const Map*) {
    const auto map = MakeSubmapMap(method, kVoxel_m, model_);
    return dynamic_cast<const Map*>(map.get()) != nullptr;
  };
  EXPECT_TRUE(is(MapMethod::kCached, &vog_));
  EXPECT_TRUE(is(MapMethod::kDirect, &direct_));
  EXPECT_TRUE(is(MapMethod::kAlgorithm1, static_cast<const Algorithm1Map*>(nullptr)));
  EXPECT_TRUE(is(MapMethod::kIncrementalMerge, static_cast<const IncrementalMergeMap*>(nullptr)));
}

}  // namespace
}  // namespace vog
