#include "lib/loopclosure/region.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <set>

#include "lib/geometry/odometry.h"
#include "lib/loopclosure/loop_closure.h"
#include "lib/loopclosure/submaps_testing.h"

namespace vog {
namespace {

const IcpOptions kIcp;

SubmapShape ShapeOf(const SubmapPtr& submap) {
  return SubmapShape(submap, {Pose3::Identity(), submap->drift / 3}, 0, {}, kIcp);
}

/// Two walls that meet: one submap has seen one of them, one the other, a third both.
class CornerTest : public testing::Test {
 protected:
  CornerTest() {
    one_->drift = Vec3(0.003, 0.001, 1e-4).asDiagonal();
    other_->drift = Vec3(0.002, 0.004, 2e-4).asDiagonal();
  }

  SubmapRegion Joined(const SubmapShape& one, const SubmapShape& other, const SubmapShape& source,
                      const Pose3& X_ik) const {
    return {{{&one}, {&other, Ominus(X_Wi_, X_Wm_), covariance_}}, source, X_ik};
  }

  const std::vector<Rectangle> kWalls = {{{3, -4, -1}, {0, 8, 0}, {0, 0, 2}},
                                         {{-4, 4, -1}, {7, 0, 0}, {0, 0, 2}}};
  const Pose3 X_Wi_ = MakePose({0.3, 0.2, 0}, {0, 0, 0.4}), X_Wm_ = MakePose({-1, 1, 0});
  const Pose3 X_Wk_ = MakePose({0.6, 1, 0}, {0, 0, 1});
  const Pose3 X_ik_ = Ominus(X_Wi_, X_Wk_);
  const Mat3 covariance_ = Vec3(0.004, 0.005, 1e-4).asDiagonal();
  std::shared_ptr<Submap> one_ = SubmapOf(2, {kWalls[0]}, X_Wi_);
  std::shared_ptr<Submap> other_ = SubmapOf(3, {kWalls[1]}, X_Wm_);
  std::shared_ptr<Submap> source_ = SubmapOf(9, kWalls, X_Wk_, 4);
};

TEST_F(CornerTest, ASubmapAloneIsARegion) {
  const SubmapShape one = ShapeOf(one_);
  const SubmapRegion region = one;
  EXPECT_EQ(region.id(), 2);
  EXPECT_EQ(region.cloud.get(), &one.cloud);
  EXPECT_EQ(region.content_drift, one.content_drift);
  ASSERT_EQ(region.members.size(), 1u);
  EXPECT_TRUE(region.members[0].X_im.isApprox(Pose3::Identity()));
}

// Point by point.
TEST_F(CornerTest, HoldsThePointsThatTheSourceMaySee) {
  const SubmapShape one = ShapeOf(one_), other = ShapeOf(other_), source = ShapeOf(source_);
  const Pose3 predicted = X_ik_ * Exp(Twist(0.2, -0.1, 0, 0, 0, 0.05));
  const SubmapRegion region = Joined(one, other, source, predicted);
  std::size_t p = 0, left_out = 0;
  Mat3 drift = Mat3::Zero();
  for (const SubmapRegion::Member& member : region.members) {
    const RegistrationCloud& cloud = member.shape->cloud;
    const Mat3 Ad = PlanarAdjointOf(member.X_im);
    for (std::size_t q = 0; q < cloud.size(); ++q) {
      const Vec3 p_i = member.X_im * cloud.points()[q];
      if (!source.HasNear(predicted.inverse() * p_i)) {
        ++left_out;
        continue;
      }
      ASSERT_LT(p, region.cloud->size());
      EXPECT_TRUE(region.cloud->points()[p].isApprox(p_i));
      const LocalPlane &plane = region.cloud->planes()[p], &own = cloud.planes()[q];
      EXPECT_TRUE(plane.normal.isApprox(member.X_im.linear() * own.normal) || own.normal.isZero());
      EXPECT_EQ(plane.variance_m2, own.variance_m2);
      drift += member.covariance + Ad * member.shape->content_drift * Ad.transpose();
      ++p;
    }
  }
  EXPECT_EQ(p, region.cloud->size());
  EXPECT_GT(p, 100u);
  EXPECT_GT(left_out, 100u);
  EXPECT_LT((region.content_drift - drift / static_cast<double>(p)).norm(), 1e-12);
  EXPECT_TRUE(Joined(one, other, source, MakePose({100, 0, 0})).content_drift.isZero());
}

TEST_F(CornerTest, TellsTogetherWhatNoneTellsAlone) {
  const SubmapShape one = ShapeOf(one_), other = ShapeOf(other_), source = ShapeOf(source_);
  Random random(3, "region");
  for (int i = 0; i < 5; ++i) {
    const Pose3 predicted = X_ik_ * RandomMotion(Twist(0.2, 0.2, 0, 0, 0, 0.05), random);
    const auto close = [&](const SubmapRegion& target, const Pose3& predicted_X) {
      return Judge({}, kIcp, Register(kIcp, *target.cloud, source.cloud, predicted_X), target,
                   source, predicted_X, PlanarCovariance(0.3, 0.1));
    };
    const Pose3 X_mi = Ominus(X_Wm_, X_Wi_);
    EXPECT_NE(close(one, predicted).constraint.kind, ConstraintKind::kFullClosure);
    EXPECT_NE(close(other, X_mi * predicted).constraint.kind, ConstraintKind::kFullClosure);
    const SubmapRegion region = Joined(one, other, source, predicted);
    const LoopClosure closure = close(region, predicted);
    ASSERT_TRUE(closure.accepted) << closure.reason;
    EXPECT_EQ(closure.from, 2);
    EXPECT_EQ(closure.constraint.kind, ConstraintKind::kFullClosure);
    const Vec6 error = Log(Ominus(X_ik_, closure.constraint.X_ik));
    EXPECT_LT(error.head<2>().norm(), 0.06);
    EXPECT_LT(std::abs(error[5]), 0.02);
    // It promises no more than the region's drift allows.
    const Mat3 Ad_ki = PlanarAdjointOf(closure.constraint.X_ik.inverse());
    const Mat3 least = Ad_ki * region.content_drift * Ad_ki.transpose() + source.content_drift;
    const Mat3 more = PlanarOf(closure.constraint.Information()).inverse() - least;
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(more).eigenvalues()[0], 0);
  }
}

// A member that contradicts counts, also where the anchor knows nothing.
TEST_F(CornerTest, WaterThatAnyMemberHasSeenFreeCounts) {
  for (int y = -30; y < 30; ++y)
    for (int x = -30; x < 30; ++x)
      for (int z = -5; z < 5; ++z) {
        LogOddsUnits& units = other_->grid.At({x, y, z});
        if (units == kUnknownUnits) units = -5;
      }
  const SubmapShape one = ShapeOf(one_), other = ShapeOf(other_), source = ShapeOf(source_);
  const SubmapRegion region = Joined(one, other, source, X_ik_);
  EXPECT_LT(ShareInFreeWater(region, source, X_ik_), 0.05);
  // The second wall 1 m nearer to where it was seen from.
  const Pose3 nearer = Ominus(X_Wi_, MakePose({0, -1, 0}) * X_Wk_);
  EXPECT_LT(ShareInFreeWater(one, source, nearer), 0.05);
  EXPECT_GT(ShareInFreeWater(region, source, nearer), 0.3);
}

/// A chain of poses, each known to 5 cm from the one before.
PoseGraph Chain(int count) {
  PoseGraph graph({});
  for (NodeId id = 0; id < count; ++id) {
    graph.AddNode(id, MakePose({0.3 * id, 0.1 * id, 0}, {0, 0, 0.05 * id}));
    graph.SetPrior(id, {0, 0, 0, 0.01, 0.01});
    if (id > 0)
      graph.AddConstraint({id - 1, id, ConstraintKind::kOdometry,
                           Ominus(graph.X_W(id - 1), graph.X_W(id)),
                           WhiteningOf(PlanarCovariance(0.05, 0.01))});
  }
  return graph;
}

TEST(JoinRegionsTest, JoinsThoseWhosePlacesAreKnownAndThatShowMost) {
  constexpr int kCount = 30, kPoints = 40;
  const PoseGraph graph = Chain(kCount);
  Random random(1, "join");
  std::map<SubmapId, std::vector<bool>> covers;
  std::vector<std::unique_ptr<SubmapShape>> shapes;
  std::vector<LoopCandidate> candidates;
  for (SubmapId id = 0; id < kCount; ++id) {
    std::vector<bool> cover;
    for (int p = 0; p < kPoints; ++p) cover.push_back(random.Uniform(0, 1) < 0.15);
    covers[id] = cover;
    LoopCandidate candidate{id};
    candidate.information = random.Uniform(0, 1);
    candidate.Cover(cover);
    shapes.push_back(std::make_unique<SubmapShape>(SubmapOf(id, {}, Pose3::Identity()),
                                                   SubmapAnchor{}, 0, LoopClosureOptions{}, kIcp));
    candidate.members = {{shapes.back().get()}};
    candidates.push_back(candidate);
  }
  for (const int most : {2, 4}) {
    LoopClosureOptions options;
    options.region_submaps = most;
    options.max_candidates = 5;
    const auto regions = JoinRegions(options, kIcp, graph, candidates);
    ASSERT_FALSE(regions.empty());
    EXPECT_LE(regions.size(), 5u);
    std::set<SubmapId> used;
    double information = std::numeric_limits<double>::max();
    for (const LoopCandidate& region : regions) {
      EXPECT_LE(region.information, information);
      information = region.information;
      EXPECT_GT(region.members.size(), 1u);
      EXPECT_LE(region.members.size(), static_cast<std::size_t>(most));
      EXPECT_EQ(region.members[0].shape->id, region.id);
      std::vector<bool> covered(kPoints);
      for (const SubmapRegion::Member& member : region.members) {
        const SubmapId id = member.shape->id;
        EXPECT_TRUE(used.insert(id).second) << "each in one region";
        EXPECT_TRUE(member.X_im.isApprox(Ominus(graph.X_W(region.id), graph.X_W(id)), 1e-9));
        for (int p = 0; p < kPoints; ++p) covered[p] = covered[p] || covers[id][p];
        if (id == region.id) continue;
        const Mat6 covariance = graph.RelativeCovariances({{id, region.id}})[0];
        EXPECT_LE(HorizontalSigma(covariance), kIcp.end_distance_m / 2);
        EXPECT_LT((member.covariance - PlanarOf(covariance)).norm(), 1e-6);
      }
      EXPECT_DOUBLE_EQ(region.predicted_overlap,
                       std::count(covered.begin(), covered.end(), true) / double{kPoints});
      EXPECT_GE(region.predicted_overlap, options.min_predicted_overlap);
    }
  }
  LoopClosureOptions options;
  options.min_predicted_overlap = 0.99;
  EXPECT_TRUE(JoinRegions(options, kIcp, graph, candidates).empty());
  EXPECT_TRUE(JoinRegions({}, kIcp, graph, {}).empty());
  EXPECT_TRUE(JoinRegions({}, kIcp, graph, {candidates[3]}).empty()) << "nothing to join";
}

}  // namespace
}  // namespace vog
