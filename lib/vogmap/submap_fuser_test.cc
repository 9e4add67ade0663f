#include "lib/vogmap/submap_fuser.h"

#include <gtest/gtest.h>

#include <memory>

#include "lib/submap/submaps_testing.h"
#include "lib/vogmap/fuse_submaps.h"
#include "lib/vogmap/vog_map.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.1;

Vec6 Noise(double sigma, Random& random) {
  Vec6 noise = Vec6::Zero();
  noise.head<3>() = random.GaussianVector(Vec3::Constant(sigma));
  noise[5] = random.Gaussian(sigma);
  return noise;
}

class SubmapFuserTest : public testing::Test {
 protected:
  SubmapFuserTest() {
    options_.enabled = true;
    options_.settled_versions = 3;
    Start();
  }
  void Start() {
    map_ = std::make_unique<VogMap>(kVoxel_m, model_);
    dut_ = std::make_unique<SubmapFuser>(*map_, options_, model_);
  }

  /// Adds a submap near `place_W`, at its pose.
  void Add(SubmapId id, const Vec3& place_W = Vec3::Zero()) {
    submaps_[id] = RandomSubmap(id, kVoxel_m, random_);
    X_WM_[id] = MakePose(place_W) * Exp(Noise(0.1, random_));
    dut_->Place(submaps_[id], X_WM_[id]);
  }
  void Move(int versions = 1) {
    for (int i = 0; i < versions; ++i) dut_->Move(X_WM_, {sigmas_m_.begin(), sigmas_m_.end()});
  }
  /// After this many solutions with equal poses, submaps are fused.
  int versions() const { return options_.settled_versions + 1; }

  std::vector<float> AnswersOf(const OccupancyMap& map) const {
    std::vector<float> answers;
    map.LogOddsIn({{-25, -25, -25}, {25, 25, 25}}, answers);
    for (float& answer : answers) answer = IsKnown(answer) ? answer : -100;
    return answers;
  }
  std::vector<float> AnswersOfSingleSubmaps() const {
    VogMap map(kVoxel_m, model_);
    for (const auto& [id, submap] : submaps_) map.Place(submap, X_WM_.at(id));
    return AnswersOf(map);
  }
  void ExpectAllThere() const {
    ASSERT_EQ(dut_->size(), static_cast<int>(submaps_.size()));
    for (const auto& [id, submap] : submaps_) {
      EXPECT_EQ(TableOf(dut_->submap(id)->grid), TableOf(submap->grid));
      EXPECT_EQ(dut_->submap(id)->last_scan, submap->last_scan);
      EXPECT_EQ(dut_->outline(id)->scans, submap->scans);
      EXPECT_EQ(dut_->X_WM(id).matrix(), X_WM_.at(id).matrix());
    }
    for (const SubmapId id : map_->ids()) EXPECT_EQ(map_->X_WM(id).matrix(), X_WM_.at(id).matrix());
  }

  FuseOptions options_;
  SensorModel model_{SensorModelOptions{}};
  Random random_{1, testing::UnitTest::GetInstance()->current_test_info()->name()};
  std::map<SubmapId, SubmapPtr> submaps_;
  std::map<SubmapId, Pose3> X_WM_;
  std::map<SubmapId, double> sigmas_m_;
  std::unique_ptr<VogMap> map_;
  std::unique_ptr<SubmapFuser> dut_;
};

TEST_F(SubmapFuserTest, FusesNothingUnlessAsked) {
  options_.enabled = false;
  Start();
  for (int id = 0; id < 3; ++id) Add(id);
  Move(20);
  EXPECT_EQ(map_->size(), 3);
  EXPECT_EQ(AnswersOf(*map_), AnswersOfSingleSubmaps());
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, FusesWhatHasSettled) {
  for (int id = 0; id < 3; ++id) Add(id);
  Move(versions() - 1);
  EXPECT_EQ(map_->size(), 3);
  EXPECT_EQ(AnswersOf(*map_), AnswersOfSingleSubmaps());
  Move();
  EXPECT_EQ(map_->ids(), std::vector<SubmapId>{0});
  EXPECT_EQ(dut_->fused(), 2);
  ExpectAllThere();

  std::vector<PlacedSubmap> parts;
  for (const auto& [id, submap] : submaps_)
    parts.push_back({submap, X_WM_.at(id), X_WM_.at(id).inverse(), {}, 0});
  EXPECT_EQ(TableOf(map_->submap(0)->grid),
            TableOf(Fuse(parts[0], std::span(parts).subspan(1), model_)->grid));
}

TEST_F(SubmapFuserTest, FusesManyInSteps) {
  constexpr int kSubmaps = SubmapFuser::kMaxJoins + 5;
  for (int id = 0; id < kSubmaps; ++id) Add(id);
  Move(versions());
  EXPECT_EQ(dut_->fused(), SubmapFuser::kMaxJoins);
  Move();
  EXPECT_EQ(map_->size(), 1);
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, WaitsForMovingSubmaps) {
  for (int id = 0; id < 2; ++id) Add(id);
  for (int i = 0; i < 20; ++i) {
    X_WM_[1].translation().x() += 0.6 * kVoxel_m;
    Move();
  }
  EXPECT_EQ(map_->size(), 2);
}

TEST_F(SubmapFuserTest, SmallMotionAndMotionOfAllTogetherCountAsSettled) {
  for (int id = 0; id < 2; ++id) Add(id);
  for (int i = 0; i < versions(); ++i) {
    const Pose3 X_WW = Exp(Noise(0.3, random_));
    for (auto& [id, X_WM] : X_WM_) X_WM = X_WW * X_WM;
    X_WM_[1].translation() += random_.GaussianVector(Vec3::Constant(0.02 * kVoxel_m));
    Move();
  }
  EXPECT_EQ(map_->size(), 1);
}

TEST_F(SubmapFuserTest, AGroupMovesWithItsFirst) {
  for (int id = 0; id < 3; ++id) Add(id);
  Move(versions());
  ASSERT_EQ(map_->size(), 1);
  const SubmapPtr fused = map_->submap(0);
  const Pose3 X_WW = RandomPose(0.3, random_);
  for (auto& [id, X_WM] : X_WM_) X_WM = X_WW * X_WM;
  Move();
  EXPECT_EQ(map_->submap(0), fused);
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, PlacesFarFromEachOtherStayApart) {
  for (int id = 0; id < 6; ++id) Add(id, {id % 2 == 0 ? 0.0 : 1.8, 0, 0});
  Move(versions());
  EXPECT_EQ(map_->ids(), (std::vector<SubmapId>{0, 1}));
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, UnsurePlacesStayApartAndTheLargestSigmaIsShown) {
  for (int id = 0; id < 3; ++id) Add(id);
  sigmas_m_ = {{0, 0.08}, {1, 0.1}, {2, 0.15}};
  Move(versions());
  EXPECT_EQ(map_->ids(), (std::vector<SubmapId>{0, 2}));
  sigmas_m_ = {{0, 0.1}, {1, 0.3}, {2, 0.2}};
  Move();
  EXPECT_EQ(map_->max_sigma_m(), 0.3);
}

TEST_F(SubmapFuserTest, TakesApartWhatTheGraphContradicts) {
  for (int id = 0; id < 5; ++id) Add(id);
  Move(versions());
  ASSERT_EQ(map_->size(), 1);
  X_WM_[3].translation().y() += 0.3 * kVoxel_m;
  Move();
  EXPECT_EQ(map_->size(), 1);
  X_WM_[3].translation().y() += 0.3 * kVoxel_m;
  Move();
  // The others, and it from where it is now on, have to settle anew with it only.
  EXPECT_EQ(map_->ids(), (std::vector<SubmapId>{0, 3}));
  ExpectAllThere();
  Move(versions());
  EXPECT_EQ(map_->size(), 1);

  for (auto& [id, X_WM] : X_WM_) X_WM.translation().z() += id * kVoxel_m;
  Move();
  EXPECT_EQ(map_->size(), 5);
  EXPECT_EQ(AnswersOf(*map_), AnswersOfSingleSubmaps());
  EXPECT_EQ(dut_->packed_bytes(), 0u);
  ExpectAllThere();
}

// Two rounds that a loop closure brings together.
TEST_F(SubmapFuserTest, AGroupDissolvesIntoAnOlderOne) {
  for (int id = 0; id < 3; ++id) Add(id);
  for (int id = 3; id < 6; ++id) Add(id, {4, 0, 0});
  Move(versions());
  EXPECT_EQ(map_->ids(), (std::vector<SubmapId>{0, 3}));
  for (int id = 3; id < 6; ++id) X_WM_[id].translation().x() -= 4;
  Move();
  EXPECT_EQ(map_->ids(), (std::vector<SubmapId>{0, 3}));
  Move(versions());
  EXPECT_EQ(map_->ids(), std::vector<SubmapId>{0});
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, ReplacingAMemberTakesItsGroupApart) {
  for (int id = 0; id < 3; ++id) Add(id);
  Move(versions());
  Add(1);
  EXPECT_EQ(map_->size(), 3);
  EXPECT_EQ(AnswersOf(*map_), AnswersOfSingleSubmaps());
  ExpectAllThere();
}

TEST_F(SubmapFuserTest, ClearForgetsAll) {
  for (int id = 0; id < 3; ++id) Add(id);
  Move(versions());
  dut_->Clear();
  EXPECT_EQ(dut_->size(), 0);
  EXPECT_EQ(map_->size(), 0);
  for (int id = 0; id < 3; ++id) Add(id);
  Move(versions() - 1);
  EXPECT_EQ(map_->size(), 3);
}

// Hours in the same place.
TEST_F(SubmapFuserTest, TheMapStaysSmallHoweverManySubmapsComeAndEqualCallsGiveEqualMaps) {
  VogMap other_map(kVoxel_m, model_);
  SubmapFuser other(other_map, options_, model_);
  for (int id = 0; id < 60; ++id) {
    Add(id, {id % 3 == 0 ? 0.0 : 1.0, 0, 0});
    other.Place(submaps_[id], X_WM_[id]);
    for (auto& [moved, X_WM] : X_WM_)
      if (random_.Chance(0.005)) X_WM = X_WM * Exp(Noise(0.05, random_));
    Move();
    other.Move(X_WM_, {});
    EXPECT_EQ(map_->ids(), other_map.ids());
  }
  EXPECT_LE(map_->size(), 20);
  EXPECT_EQ(AnswersOf(*map_), AnswersOf(other_map));
  ExpectAllThere();
  // Until nothing moves any more.
  Move(2 * versions());
  EXPECT_LE(map_->size(), 4);
}

// Whoever has lost a submap fuses it when it has come, and shows the same.
TEST_F(SubmapFuserTest, ALateSubmapIsFusedAsItsPosesHaveBeenTold) {
  for (int id = 0; id < 3; ++id) Add(id);
  VogMap late_map(kVoxel_m, model_);
  SubmapFuser late(late_map, options_, model_);
  for (int id = 0; id < 2; ++id) late.Place(submaps_[id], X_WM_[id]);
  Move(versions());
  for (int i = 0; i < versions(); ++i) late.Move(X_WM_, {});
  late.Place(submaps_[2], X_WM_[2]);
  EXPECT_EQ(late_map.size(), 2);
  late.Move(X_WM_, {});
  EXPECT_EQ(late_map.ids(), map_->ids());
}

}  // namespace
}  // namespace vog
