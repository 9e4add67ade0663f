#include "lib/loopclosure/loop_closure.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "lib/base/chi_square.h"
#include "lib/geometry/odometry.h"
#include "lib/loopclosure/submaps_testing.h"

namespace vog {
namespace {

const IcpOptions kIcp;

SubmapShape ShapeOf(const SubmapPtr& submap, const LoopClosureOptions& options = {}) {
  return SubmapShape(submap, {Pose3::Identity(), submap->drift / 3}, 0, options, kIcp);
}

/// Two views of the room from places a metre or so apart.
class LoopClosureTest : public testing::Test {
 protected:
  LoopClosure Close(const Pose3& predicted_X_ik, const Mat6& covariance) const {
    const auto target = ShapeOf(target_), source = ShapeOf(source_);
    return Judge(options_, kIcp, Register(kIcp, target.cloud, source.cloud, predicted_X_ik), target,
                 source, predicted_X_ik, covariance);
  }

  const Pose3 X_Wi_ = MakePose({-0.5, 0.3, 0}, {0, 0, 0.4});
  const Pose3 X_Wk_ = MakePose({0.6, -0.4, 0}, {0, 0, -0.5});
  const Pose3 X_ik_ = Ominus(X_Wi_, X_Wk_);
  std::shared_ptr<Submap> target_ = SubmapOf(3, FurnishedRoom(), X_Wi_);
  std::shared_ptr<Submap> source_ = SubmapOf(9, FurnishedRoom(), X_Wk_);
  LoopClosureOptions options_;
};

TEST_F(LoopClosureTest, PredictedOverlapIsTheBruteForceShare) {
  Random random(2, "overlap");
  const SubmapShape target = ShapeOf(target_), source = ShapeOf(source_);
  for (int i = 0; i < 4; ++i) {
    const Pose3 X_ik = RandomMotion(Twist(4, 4, 0.5, 0, 0, 3), random);
    int shared = 0;
    for (const Vec3& p_k : source.cloud.points()) {
      const VoxelKey a = target.cells.KeyOf(X_ik * p_k);
      shared += std::any_of(
          target.cloud.points().begin(), target.cloud.points().end(), [&](const Vec3& p_i) {
            const VoxelKey b = target.cells.KeyOf(p_i);
            return std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1 && std::abs(a.z - b.z) <= 1;
          });
    }
    EXPECT_DOUBLE_EQ(PredictOverlap(target, source, X_ik),
                     shared / static_cast<double>(source.cloud.size()));
  }
  EXPECT_EQ(PredictOverlap(target, target, Pose3::Identity()), 1);
  EXPECT_EQ(PredictOverlap(target, source, MakePose({100, 0, 0})), 0);
  EXPECT_EQ(PredictOverlap(target, ShapeOf(SubmapOf(1, {}, X_Wi_)), Pose3::Identity()), 0);
}

TEST_F(LoopClosureTest, CandidatesAreThoseThatOverlapFarEnoughApart) {
  std::vector<std::unique_ptr<SubmapShape>> shapes;
  std::vector<const SubmapShape*> targets;
  std::vector<Pose3> X_ik;
  const SubmapShape source = ShapeOf(source_);
  for (SubmapId id = 0; id < 9; ++id) {
    const Pose3 X_Wi = MakePose({1.4 * id - 4, 0.2 * id, 0}, {0, 0, 0.1 * id});
    shapes.push_back(std::make_unique<SubmapShape>(SubmapOf(id, FurnishedRoom(), X_Wi, 3),
                                                   SubmapAnchor{}, 0, options_, kIcp));
    targets.push_back(shapes.back().get());
    X_ik.push_back(Ominus(X_Wi, X_Wk_));
  }
  options_.min_separation = 3;
  std::vector<SubmapId> expected;
  for (int i = 0; i < 9; ++i)
    if (source.id - i >= 3 && PredictOverlap(*targets[i], source, X_ik[i]) > 0)
      expected.push_back(i);
  ASSERT_GT(expected.size(), 2u);
  ASSERT_LT(expected.size(), 7u);
  const auto candidates = FindCandidates(options_, targets, source, X_ik);
  ASSERT_EQ(candidates.size(), expected.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    EXPECT_EQ(candidates[c].id, expected[c]);
    EXPECT_EQ(candidates[c].predicted_overlap,
              PredictOverlap(*targets[expected[c]], source, X_ik[expected[c]]));
    EXPECT_EQ(candidates[c].members.front().shape, targets[expected[c]]);
    EXPECT_EQ(candidates[c].covered, PointsIn(*targets[expected[c]], source, X_ik[expected[c]]));
  }
  options_.min_separation = 10;
  EXPECT_TRUE(FindCandidates(options_, targets, source, X_ik).empty());
}

TEST_F(LoopClosureTest, ASubmapIsNeededWhereTooFewOthersHoldItsContent) {
  const SubmapShape source = ShapeOf(source_), target = ShapeOf(target_);
  const double overlap = PredictOverlap(target, source, X_ik_);
  ASSERT_GT(overlap, 0.6);
  const auto is_needed = [&](int holders, int elsewhere, const SubmapShape& of) {
    std::vector<const SubmapShape*> targets(static_cast<std::size_t>(holders + elsewhere), &target);
    std::vector<Pose3> X_ik(static_cast<std::size_t>(holders), X_ik_);
    X_ik.resize(targets.size(), MakePose({100, 0, 0}));
    return IsNeeded(options_, targets, of, X_ik);
  };
  options_.enough_targets = 3;
  EXPECT_TRUE(is_needed(0, 0, source));
  EXPECT_TRUE(is_needed(2, 5, source));
  EXPECT_FALSE(is_needed(3, 0, source));
  EXPECT_FALSE(is_needed(3, 5, source));
  // Half of what it shows is to be seen in no other.
  const SubmapShape half_new = ShapeOf(SubmapOf(10, FurnishedRoom(), MakePose({4.5, 0, 0}), 3));
  const Pose3 X_i_new = Ominus(X_Wi_, MakePose({9, 0, 0}));
  ASSERT_LT(PredictOverlap(target, half_new, X_i_new), 0.5);
  EXPECT_TRUE(IsNeeded(options_, {&target, &target, &target, &target}, half_new,
                       {X_i_new, X_i_new, X_i_new, X_i_new}));
}

TEST_F(LoopClosureTest, TheMostInformativeCandidatesAreKeptInOrder) {
  const std::vector<double> information = {0.3, 2, 0.3, 1, 0};
  for (const int most : {0, 1, 3, 7}) {
    std::vector<LoopCandidate> candidates;
    for (SubmapId id = 0; id < 5; ++id)
      candidates.push_back({id, 1, Mat6::Zero(), information[id]});
    options_.max_candidates = most;
    KeepBest(options_, &LoopCandidate::information, candidates);
    const std::vector<SubmapId> order = {1, 3, 0, 2, 4};
    ASSERT_EQ(candidates.size(), std::min<std::size_t>(most, order.size()));
    for (std::size_t c = 0; c < candidates.size(); ++c) EXPECT_EQ(candidates[c].id, order[c]);
  }
}

// Walks along a wall whose points a random walk displaces: what turns the cloud back.
TEST(FeignedTurnTest, IsThatOfASweepDisplacedByARandomWalk) {
  constexpr int kWalks = 4000, kSteps = 200;
  constexpr double kLength_m = 4, kVariance_m2 = 0.01;
  Random random(1, "sweep");
  std::vector<Vec3> points_C;
  for (int step = 0; step < kSteps; ++step)
    points_C.push_back({3 + kLength_m * (step / (kSteps - 1.0) - 0.5), 0.5, -1});
  double squares = 0;
  for (int walk = 0; walk < kWalks; ++walk) {
    double displaced = 0, moment = 0, inertia = 0;
    for (const Vec3& p : points_C) {
      displaced += random.Gaussian(std::sqrt(kVariance_m2 / kSteps));
      moment += (p.x() - 3) * displaced;
      inertia += std::pow(p.x() - 3, 2);
    }
    squares += std::pow(moment / inertia, 2) / kWalks;
  }
  const Mat3 drift = Vec3(kVariance_m2, kVariance_m2, 1e-6).asDiagonal();
  const Mat3 turn = FeignedTurn(drift, points_C);
  EXPECT_NEAR(turn(2, 2) / squares, 1, 0.1);
  // About the middle (3, 0.5): nothing moves there.
  const Mat3 to_middle = PlanarAdjointOf(MakePose({-3, -0.5, 0}));
  const Mat3 at_middle = to_middle * turn * to_middle.transpose();
  EXPECT_LT((at_middle.topLeftCorner<2, 2>().norm()), 1e-12);
  EXPECT_TRUE(FeignedTurn(drift, {}).isZero());
  EXPECT_TRUE(FeignedTurn(drift, {Vec3(1, 2, 3)}).isZero());
}

// By hand where everything is diagonal.
TEST_F(LoopClosureTest, ExpectedInformationIsThatOfAMeasurementOfThePose) {
  target_->drift = source_->drift = Vec3(0, 0, 0.001).asDiagonal();
  const SubmapShape target = ShapeOf(target_), source = ShapeOf(source_);
  const double radius_m = source.cloud.radius_m(), point = kIcp.point_sigma_m * kIcp.point_sigma_m;
  const LoopCandidate candidate{3, 0.7, PlanarCovariance(0.5, 0.1)};
  double expected = 0;
  const double P[3] = {0.25, 0.25, 0.01}, drift[3] = {0, 0, 0.001};
  for (int axis = 0; axis < 3; ++axis) {
    const double R = 2 * drift[axis] / 3 + (axis < 2 ? point : point / (radius_m * radius_m));
    expected += 0.5 * 0.7 * std::log(1 + P[axis] / R);
  }
  EXPECT_NEAR(ExpectedInformation(kIcp, target, source, Pose3::Identity(), candidate), expected,
              1e-12);
  EXPECT_EQ(ExpectedInformation(kIcp, target, source, X_ik_, {3, 0.7}), 0) << "known already";
}

TEST_F(LoopClosureTest, AcceptsWhatThePredictionAllowsAndMeasuresIt) {
  Random random(3, "closure");
  for (int i = 0; i < 5; ++i) {
    const Pose3 predicted = X_ik_ * RandomMotion(Twist(0.3, 0.3, 0, 0, 0, 0.08), random);
    const LoopClosure closure = Close(predicted, PlanarCovariance(0.3, 0.08));
    ASSERT_TRUE(closure.accepted) << closure.reason;
    EXPECT_EQ(closure.from, 3);
    EXPECT_EQ(closure.to, 9);
    EXPECT_EQ(closure.constraint.from, 3);
    EXPECT_EQ(closure.constraint.to, 9);
    EXPECT_EQ(closure.constraint.kind, ConstraintKind::kFullClosure);
    EXPECT_EQ(closure.directions, 3);
    const Vec6 error = Log(Ominus(X_ik_, closure.constraint.X_ik));
    EXPECT_LT(error.head<2>().norm(), 0.03);
    EXPECT_LT(std::abs(error[5]), 0.01);
    EXPECT_LT((closure.constraint.whitening * error).squaredNorm(), ChiSquare99(3));
  }
}

TEST_F(LoopClosureTest, RejectsWhatContradictsTheGraph) {
  // The content says half a metre more than the graph, which is sure of 5 cm.
  const Pose3 predicted = X_ik_ * Exp(Twist(0.4, -0.3, 0, 0, 0, 0));
  const LoopClosure closure = Close(predicted, PlanarCovariance(0.05, 0.02));
  EXPECT_FALSE(closure.accepted);
  EXPECT_EQ(closure.reason, "contradicts the graph");
  EXPECT_GT(closure.chi_square, ChiSquare99(3));
  EXPECT_TRUE(Close(predicted, PlanarCovariance(0.3, 0.05)).accepted);
}

TEST_F(LoopClosureTest, DoesNotAcceptAClosureThatIsAMetreOff) {
  for (const double angle : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
    const Pose3 predicted = X_ik_ * Exp(Twist(std::cos(angle), std::sin(angle), 0, 0, 0, 0));
    EXPECT_FALSE(Close(predicted, PlanarCovariance(0.1, 0.02)).accepted) << angle;
  }
}

// Literal form: innovation against the sum of all three covariances.
TEST_F(LoopClosureTest, ChiSquareIsThatOfTheInnovation) {
  target_->drift = Vec3(0.02, 0.01, 0.001).asDiagonal();
  source_->drift = Vec3(0.005, 0.03, 0.002).asDiagonal();
  const Pose3 predicted = X_ik_ * Exp(Twist(0.1, -0.05, 0, 0, 0, 0.02));
  const Mat6 P = PlanarCovariance(0.1, 0.02);
  const LoopClosure closure = Close(predicted, P);
  const SubmapShape target = ShapeOf(target_), source = ShapeOf(source_);
  const IcpResult icp = Register(kIcp, target.cloud, source.cloud, predicted);
  const auto inside = [](const Submap& submap, const SubmapShape& shape) -> Mat3 {
    return submap.drift / 3 + FeignedTurn(submap.drift, shape.cloud.points());
  };
  const Mat6 Ad = AdjointOf(icp.X_ik.inverse());
  const Mat3 drift = PlanarOf(Ad * PlanarTo6(inside(*target_, target)) * Ad.transpose()) +
                     inside(*source_, source);
  const Vec6 xi = Log(Ominus(icp.X_ik, predicted));
  const Vec3 innovation(xi[0], xi[1], xi[5]);
  const Mat3 R = 2 * PlanarOf(icp.covariance) + drift;
  const Mat3 S = R + PlanarOf(P);
  EXPECT_NEAR(closure.chi_square, innovation.dot(S.inverse() * innovation), 1e-6);
  const Mat3 information = PlanarOf(closure.constraint.Information());
  EXPECT_LT((information * R - Mat3::Identity()).norm(), 1e-6);
}

TEST_F(LoopClosureTest, AWallAloneIsAPartialClosure) {
  const std::vector<Rectangle> wall = {{{2, -4, -1}, {0, 8, 0}, {0, 0, 2}}};
  target_ = SubmapOf(3, wall, Pose3::Identity());
  source_ = SubmapOf(9, wall, MakePose({0.2, 0.3, 0}));
  const Pose3 X_ik = MakePose({0.2, 0.3, 0});
  const LoopClosure closure =
      Close(X_ik * Exp(Twist(0.1, 0.2, 0, 0, 0, 0.02)), PlanarCovariance(0.2, 0.05));
  ASSERT_TRUE(closure.accepted) << closure.reason;
  EXPECT_EQ(closure.constraint.kind, ConstraintKind::kPartialClosure);
  EXPECT_EQ(closure.directions, 2);
  EXPECT_EQ(closure.constraint.whitening.rows(), 2);
  const Mat6 information = closure.constraint.Information();
  EXPECT_GT(information(0, 0), 100);
  EXPECT_LT(information(1, 1), 1e-3 * information(0, 0)) << "along the wall";
  EXPECT_NEAR(closure.constraint.X_ik.translation().x(), 0.2, 0.06);  // Half a voxel.

  options_.min_directions = 3;
  const LoopClosure refused = Close(X_ik, PlanarCovariance(0.2, 0.05));
  EXPECT_FALSE(refused.accepted);
  EXPECT_EQ(refused.reason, "too few directions");
}

TEST_F(LoopClosureTest, RejectsSmallOverlap) {
  const std::vector<Rectangle> corner = {{{2, -4, -1}, {0, 8, 0}, {0, 0, 2}},
                                         {{-4, 2, -1}, {6, 0, 0}, {0, 0, 2}}};
  const std::vector<Rectangle> cut = {corner[0], {{0, 2, -1}, {2, 0, 0}, {0, 0, 2}}};
  const Pose3 X_Wi = MakePose({0, 0, 0}, {0, 0, 0.7});
  const Pose3 X_ik = MakePose({0.1, -0.2, 0}, {0, 0, 0.3});
  target_ = SubmapOf(3, cut, X_Wi);
  source_ = SubmapOf(9, corner, X_Wi * X_ik);
  options_.min_overlap = 0.95;
  const LoopClosure closure = Close(X_ik, PlanarCovariance(0.2, 0.05));
  EXPECT_FALSE(closure.accepted);
  EXPECT_EQ(closure.reason, "small overlap");
  EXPECT_LT(closure.overlap, 0.95);
  options_.min_overlap = 0.3;
  EXPECT_EQ(Close(X_ik, PlanarCovariance(0.2, 0.05)).reason, "");
}

// Two walls a metre apart, of which each submap sees one: registration lays them on each other.
// Two walls a way apart, of which each submap sees one: registration lays them on each other.
TEST_F(LoopClosureTest, RejectsPointsInWaterThatTheOtherHasSeenFree) {
  const Pose3 X_WM = MakePose({0.1, 0, 0}, {0, 0, 0.4});
  target_ = SubmapOf(3, {{{2, -4, -1}, {0, 8, 0}, {0, 0, 2}}}, X_WM);
  source_ = SubmapOf(9, {{{1.4, -4, -1}, {0, 8, 0}, {0, 0, 2}}}, X_WM * MakePose({0, 0.1, 0}));
  options_.both_ways = false;
  EXPECT_EQ(Close(Pose3::Identity(), PlanarCovariance(0.5, 0.05)).reason, "");
  // The target has seen the water before its wall; a part of the source's wall is a little nearer.
  for (int y = -40; y < 40; ++y)
    for (int x = -40; x < 40; ++x)
      for (int z = -9; z < 9; ++z) {
        LogOddsUnits& units = target_->grid.At({x, y, z});
        if (units == kUnknownUnits) units = -kOccupiedUnits;
      }
  EXPECT_EQ(Close(Pose3::Identity(), PlanarCovariance(0.5, 0.05)).reason, "");
  source_ =
      SubmapOf(9, {{{1.4, -4, -1}, {0, 8, 0}, {0, 0, 2}}, {{1, -3, -1}, {0, 4, 0}, {0, 0, 2}}},
               X_WM * MakePose({0, 0.1, 0}));
  const LoopClosure closure = Close(Pose3::Identity(), PlanarCovariance(0.5, 0.05));
  EXPECT_FALSE(closure.accepted);
  EXPECT_EQ(closure.reason, "points in free water");
  options_.max_share_in_free_water = 1;
  EXPECT_EQ(Close(Pose3::Identity(), PlanarCovariance(0.5, 0.05)).reason, "");
}

TEST_F(LoopClosureTest, ShareInFreeWaterIsTheBruteForceShare) {
  Random random(4, "water");
  for (int y = -30; y < 30; ++y)
    for (int x = -30; x < 30; ++x)
      for (int z = -5; z < 5; ++z) {
        LogOddsUnits& units = target_->grid.At({x, y, z});
        if (units == kUnknownUnits) units = -5;
      }
  const SubmapShape target = ShapeOf(target_),
                    source = ShapeOf(SubmapOf(9, FurnishedRoom(), X_Wk_, 2.8));
  ASSERT_LE(source.cloud.size(), 800u);
  double most = 0;
  for (int i = 0; i < 20; ++i) {
    const Pose3 X_ik = X_ik_ * RandomMotion(Twist(1, 1, 0.2, 0, 0, 0.5), random);
    int known = 0, in_water = 0;
    for (const Vec3& p_k : source.cloud.points()) {
      const VoxelKey at = target_->grid.grid().KeyOf(X_ik * p_k);
      if (target_->grid.Get(at) == kUnknownUnits) continue;
      ++known;
      bool is_near = false;
      target_->grid.ForEach([&](const VoxelKey& key, LogOddsUnits units) {
        is_near |= units >= 0 && std::abs(key.x - at.x) <= 2 && std::abs(key.y - at.y) <= 2 &&
                   std::abs(key.z - at.z) <= 2;
      });
      in_water += !is_near;
    }
    const double share = known == 0 ? 0 : static_cast<double>(in_water) / known;
    EXPECT_DOUBLE_EQ(ShareInFreeWater(target, source, X_ik), share);
    most = std::max(most, share);
  }
  EXPECT_GT(most, 0.3);
  EXPECT_LT(ShareInFreeWater(target, source, X_ik_), 0.05);
}

TEST_F(LoopClosureTest, AgreesTheOtherWayOnlyWhereItIsRight) {
  const SubmapShape target = ShapeOf(target_), source = ShapeOf(source_);
  Random random(5, "other way");
  for (int i = 0; i < 5; ++i) {
    IcpResult right = Register(kIcp, target.cloud, source.cloud,
                               X_ik_ * RandomMotion(Twist(0.2, 0.2, 0, 0, 0, 0.05), random));
    EXPECT_TRUE(AgreesTheOtherWay(kIcp, right, target, source)) << i;
    const double angle = random.Uniform(0, 6.28);
    right.X_ik = right.X_ik * Exp(Twist(0.5 * std::cos(angle), 0.5 * std::sin(angle), 0, 0, 0, 0));
    EXPECT_FALSE(AgreesTheOtherWay(kIcp, right, target, source)) << i;
  }
}

TEST_F(LoopClosureTest, RejectsWhatIsNotTheSameTheOtherWayRound) {
  const SubmapShape target = ShapeOf(target_), source = ShapeOf(source_);
  IcpResult wrong = Register(kIcp, target.cloud, source.cloud, X_ik_);
  wrong.X_ik = wrong.X_ik * Exp(Twist(0.3, 0, 0, 0, 0, 0));
  const auto judge = [&] {
    return Judge(options_, kIcp, wrong, target, source, X_ik_, PlanarCovariance(0.5, 0.05));
  };
  EXPECT_EQ(judge().reason, "not the same the other way round");
  options_.both_ways = false;
  EXPECT_TRUE(judge().accepted);
}

TEST_F(LoopClosureTest, RejectsALargeResidual) {
  options_.max_rmse_m = 0.01;
  const LoopClosure closure = Close(X_ik_, PlanarCovariance(0.2, 0.05));
  EXPECT_FALSE(closure.accepted);
  EXPECT_EQ(closure.reason, "large residual");
  EXPECT_GT(closure.rmse_m, 0.01);
}

TEST_F(LoopClosureTest, RejectsWhatCannotBeRegistered) {
  source_ = SubmapOf(9, {}, X_Wk_);
  const LoopClosure closure = Close(X_ik_, PlanarCovariance(0.2, 0.05));
  EXPECT_FALSE(closure.accepted);
  EXPECT_EQ(closure.reason, "no registration");
}

TEST_F(LoopClosureTest, IsolatedVoxelsAreNoise) {
  for (int i = 0; i < 20; ++i) source_->grid.At({10 * i - 100, 3 * i, 4}) = kOccupiedUnits;
  options_.min_neighbours = 0;
  const std::size_t all = ShapeOf(source_, options_).cloud.size();
  options_.min_neighbours = 3;
  EXPECT_LE(ShapeOf(source_, options_).cloud.size(), all - 18);
}

}  // namespace
}  // namespace vog
