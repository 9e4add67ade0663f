#include "lib/slam/slam.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "lib/base/chi_square.h"
#include "lib/loopclosure/submaps_testing.h"

namespace vog {
namespace {

constexpr double kSigma_m = 0.06, kSigmaYaw_rad = 0.02;

/// Twice around the room, with an odometry that drifts from base to base.
struct Mission {
  explicit Mission(int seed, int count = 16, double sigma_m = kSigma_m,
                   double sigma_yaw_rad = kSigmaYaw_rad) {
    Random random(static_cast<std::uint64_t>(seed), "mission");
    Pose3 X_OM;
    for (SubmapId id = 0; id < count; ++id) {
      const double angle = 4 * EIGEN_PI * id / count;
      X_WM.push_back(MakePose({2 * std::cos(angle), 1.5 * std::sin(angle), 0.1 * std::sin(angle)},
                              {0.02, -0.01, WrapAngle(angle)}));
      auto submap = SubmapOf(id, FurnishedRoom(), X_WM.back());
      Vec6 drift = Vec6::Zero();
      drift[0] = random.Gaussian(sigma_m);
      drift[1] = random.Gaussian(sigma_m);
      drift[5] = random.Gaussian(sigma_yaw_rad);
      if (id == 0) {
        X_OM = X_WM[0];
      } else {
        submap->base.edge.X_PM = Ominus(X_WM[id - 1], X_WM[id]) * Exp(drift);
        // Height and attitude do not drift.
        const Pose3 reckoned = X_OM * submap->base.edge.X_PM;
        const RollPitchYaw angles = AnglesOf(X_WM[id]);
        X_OM = MakePose(
            {reckoned.translation().x(), reckoned.translation().y(), X_WM[id].translation().z()},
            {angles.roll, angles.pitch, YawOf(reckoned)});
        submap->base.edge.X_PM = Ominus(submaps.back()->base.odometry.X_OB, X_OM);
      }
      submap->base.edge.covariance = Twist(sigma_m * sigma_m, sigma_m * sigma_m, 2e-4, 2e-5, 2e-5,
                                           sigma_yaw_rad * sigma_yaw_rad)
                                         .asDiagonal();
      submap->base.odometry.X_OB = X_OM;
      submaps.push_back(submap);
    }
  }

  /// Mean horizontal distance of the bases from where they truly are.
  double ErrorOf(const std::map<NodeId, Pose3>& poses) const {
    double sum = 0;
    for (const auto& [id, X] : poses)
      sum += (X.translation() - X_WM[id].translation()).head<2>().norm();
    return sum / static_cast<double>(poses.size());
  }
  std::map<NodeId, Pose3> Odometry() const {
    std::map<NodeId, Pose3> poses;
    for (const auto& submap : submaps) poses[submap->id()] = submap->base.odometry.X_OB;
    return poses;
  }

  std::vector<Pose3> X_WM;
  std::vector<std::shared_ptr<Submap>> submaps;
};

std::unique_ptr<Slam> SlamOf(const Mission& mission, SlamSettings settings = {}) {
  settings.loop_closure.max_candidates = 6;
  auto slam = std::make_unique<Slam>(settings);
  for (const auto& submap : mission.submaps) slam->AddSubmap(submap);
  return slam;
}

int Accepted(const Slam& slam) {
  return static_cast<int>(
      std::count_if(slam.closures().begin(), slam.closures().end(),
                    [](const Slam::Closure& closure) { return closure.loop.accepted; }));
}

TEST(SlamTest, EndsMuchNearerToTheTruthThanItsOdometry) {
  for (int seed = 0; seed < 2; ++seed) {
    const Mission mission(seed);
    const auto slam = SlamOf(mission);
    EXPECT_GT(Accepted(*slam), 20);
    EXPECT_LT(mission.ErrorOf(slam->X_WM()), 0.06);
    EXPECT_LT(mission.ErrorOf(slam->X_WM()), 0.4 * mission.ErrorOf(mission.Odometry())) << seed;
  }
}

TEST(SlamTest, WithoutClosuresIsTheOdometry) {
  const Mission mission(1);
  SlamSettings settings;
  settings.slam.loop_closures = false;
  const auto slam = SlamOf(mission, settings);
  EXPECT_TRUE(slam->closures().empty());
  for (const auto& [id, X_OM] : mission.Odometry())
    EXPECT_TRUE(slam->X_WM().at(id).isApprox(X_OM, 1e-9)) << id;
}

TEST(SlamTest, EachSubmapGrowsTheVersionByOne) {
  const Mission mission(1, 5);
  Slam slam({});
  EXPECT_EQ(slam.version(), 0);
  for (int i = 0; i < 5; ++i) {
    slam.AddSubmap(mission.submaps[i]);
    EXPECT_EQ(slam.version(), i + 1);
    EXPECT_EQ(slam.X_WM().size(), static_cast<std::size_t>(i + 1));
  }
}

TEST(SlamTest, ConstraintsAreTheEdgesAndTheAcceptedClosures) {
  const Mission mission(2);
  const auto slam = SlamOf(mission);
  EXPECT_EQ(static_cast<int>(slam->graph().constraints().size()), 15 + Accepted(*slam));
  for (const Slam::Closure& closure : slam->closures()) {
    EXPECT_EQ(closure.loop.accepted, closure.constraint >= 0);
    EXPECT_EQ(closure.loop.accepted, closure.loop.reason.empty());
    if (!closure.loop.accepted) continue;
    const Constraint& constraint = slam->graph().constraints().at(closure.constraint);
    EXPECT_EQ(constraint.from, closure.loop.from);
    EXPECT_EQ(constraint.to, closure.loop.to);
    EXPECT_LE(slam->graph().ChiSquareOf(constraint), ChiSquare99(closure.loop.directions) * 1.5);
  }
}

// The content of one submap lies 0.6 m beside its base: all its closures are wrong alike.
TEST(SlamTest, OneWrongSubmapDoesNotSpoilTheOthers) {
  Mission mission(3);
  constexpr SubmapId kWrong = 11;
  const Pose3 X_wrong = mission.X_WM[kWrong] * Exp(Twist(0.45, -0.4, 0, 0, 0, 0));
  const SubmapBase base = mission.submaps[kWrong]->base;
  mission.submaps[kWrong] = SubmapOf(kWrong, FurnishedRoom(), X_wrong);
  mission.submaps[kWrong]->base = base;
  const auto slam = SlamOf(mission);
  std::map<NodeId, Pose3> others = slam->X_WM();
  others.erase(kWrong);
  EXPECT_LT(mission.ErrorOf(others), 0.1);
  int rejected = 0;
  for (const Slam::Closure& closure : slam->closures()) {
    if (closure.loop.to != kWrong) continue;
    EXPECT_FALSE(closure.loop.accepted);
    rejected += closure.loop.reason.find("contradicts") == 0;
  }
  EXPECT_GT(rejected, 0);
}

TEST(SlamTest, SigmasGrowWithTheDistanceFromTheNewest) {
  const Mission mission(4, 10);
  SlamSettings settings;
  settings.slam.loop_closures = false;
  const auto slam = SlamOf(mission, settings);
  const auto sigma_m = [](const Slam& dut, SubmapId id) {
    return HorizontalSigma(dut.covariances().at(id).of_X_MN);
  };
  EXPECT_EQ(sigma_m(*slam, 9), 0);
  for (SubmapId id = 0; id < 9; ++id) {
    EXPECT_GT(sigma_m(*slam, id), sigma_m(*slam, id + 1));
    EXPECT_GE(sigma_m(*slam, id), 0.99 * kSigma_m * std::sqrt(9 - id));
  }
  const auto closed = SlamOf(mission);
  EXPECT_LT(sigma_m(*closed, 0), 0.5 * sigma_m(*slam, 0));
}

TEST(SlamTest, GivesTheSameBitsEachTime) {
  const Mission mission(5, 12);
  const auto a = SlamOf(mission), b = SlamOf(mission);
  for (const auto& [id, X] : a->X_WM()) EXPECT_EQ(X.matrix(), b->X_WM().at(id).matrix());
  for (const auto& [id, covariance] : a->covariances()) {
    EXPECT_EQ(covariance.of_X_WM, b->covariances().at(id).of_X_WM);
    EXPECT_EQ(covariance.of_X_MN, b->covariances().at(id).of_X_MN);
  }
  ASSERT_EQ(a->closures().size(), b->closures().size());
  for (std::size_t i = 0; i < a->closures().size(); ++i)
    EXPECT_EQ(a->closures()[i].loop.chi_square, b->closures()[i].loop.chi_square);
}

TEST(SlamTest, MayStartWithAnyNumberButTakesEachOnce) {
  const Mission mission(6, 6);
  Slam slam({});
  for (int i = 2; i < 6; ++i) slam.AddSubmap(mission.submaps[i]);
  EXPECT_EQ(slam.X_WM().size(), 4u);
  EXPECT_TRUE(slam.X_WM().at(2).isApprox(mission.submaps[2]->base.odometry.X_OB, 1e-12));
  EXPECT_THROW(slam.AddSubmap(mission.submaps[3]), std::invalid_argument);
}

TEST(SlamTest, EmptySubmapsHangOnTheirOdometry) {
  Mission mission(7, 8);
  for (auto& submap : mission.submaps) submap->grid = BrickGrid(0.095);
  const auto slam = SlamOf(mission);
  EXPECT_EQ(Accepted(*slam), 0);
  for (const auto& [id, X_OM] : mission.Odometry())
    EXPECT_TRUE(slam->X_WM().at(id).isApprox(X_OM, 1e-4)) << id;
}

// Against walks that are walked: variances of a walk's mean about where the node is, and of a
// moment about the mean.
TEST(SlamTest, AnchorsTellWhatDriftDoesToContent) {
  constexpr int kWalks = 20000, kSteps = 60;
  Random random(1, "walks");
  double mean_first = 0, mean_middle = 0, moment = 0, before = 0;
  for (int walk = 0; walk < kWalks; ++walk) {
    std::vector<double> x = {0};
    for (int step = 0; step < kSteps; ++step)
      x.push_back(x.back() + random.Gaussian(std::sqrt(1.0 / kSteps)));
    const double mean = std::accumulate(x.begin(), x.end(), 0.0) / (kSteps + 1);
    const double middle = x[kSteps / 2];
    const double at = x[static_cast<std::size_t>(random.Index(kSteps + 1))];
    mean_first += mean * mean / kWalks;
    mean_middle += (mean - middle) * (mean - middle) / kWalks;
    moment += (at - mean) * (at - mean) / kWalks;
    before += middle * middle / kWalks;
  }
  const auto submap = SubmapOf(0, FurnishedRoom(), Pose3::Identity());
  submap->drift = Mat3::Identity();
  submap->X_ML = MakePose({2, 0, 0});
  const SubmapAnchor first = AnchorOf(*submap, NodePlace::kFirst);
  const SubmapAnchor middle = AnchorOf(*submap, NodePlace::kMiddle);
  EXPECT_NEAR(first.body_drift(0, 0), mean_first, 0.02);
  EXPECT_NEAR(middle.body_drift(0, 0), mean_middle, 0.01);
  EXPECT_NEAR(first.content_drift(0, 0), moment, 0.01);
  EXPECT_NEAR(middle.content_drift(0, 0), moment, 0.01);
  EXPECT_EQ(first.drift_before(0, 0), 0);
  EXPECT_NEAR(middle.drift_before(0, 0), before, 0.02);
  EXPECT_NEAR(middle.X_MC.translation().x(), 1, 1e-9);
}

// However well closures join the content of two submaps, where the body was stays as unknown as
// the drift inside them makes it.
TEST(SlamTest, BodyCovariancesHoldTheDriftInside) {
  Mission mission(4);
  const Mat3 drift = Vec3(0.04, 0.01, 1e-4).asDiagonal();
  for (auto& submap : mission.submaps) submap->drift = drift;
  const auto slam = SlamOf(mission);
  const std::pair<NodeId, NodeId> pair{2, 10};
  const Mat6 frames = slam->graph().RelativeCovariances({pair})[0];
  const Mat6 body = slam->BodyCovariances({pair})[0];
  const Mat6 Ad = AdjointOf(Ominus(slam->graph().X_W(10), slam->graph().X_W(2)));
  Mat6 inside = Mat6::Zero();
  inside.diagonal() = Twist(0.04, 0.01, 0, 0, 0, 1e-4) / 3;
  EXPECT_LT((body - frames - inside - Ad * inside * Ad.transpose()).norm(), 1e-12);
  EXPECT_LT(slam->BodyCovariances({{3, 3}})[0].norm(), 1e-20);
  const auto of = slam->BodyCovariances({{2, 15}, {0, 2}});
  EXPECT_LT((slam->covariances().at(2).of_X_MN - of[0]).norm(), 0.02 * of[0].norm());
  EXPECT_LT((slam->covariances().at(2).of_X_WM - of[1]).norm(), 0.02 * of[1].norm());
}

// The node's place is a matter of how the graph is written: what is known of a base is not.
TEST(SlamTest, CovariancesAreThoseOfTheBasesWhateverIsTheNode) {
  const Mission mission(9, 8);
  SlamSettings settings;
  settings.slam.node = NodePlace::kMiddle;
  const auto slam = SlamOf(mission, settings);
  const Pose3 X_MC = NodeIn(mission.submaps[5]->X_ML, NodePlace::kMiddle);
  const Mat6 Ad = AdjointOf(X_MC);
  const Mat6 expected = Ad * slam->BodyCovariances({{0, 5}})[0] * Ad.transpose();
  EXPECT_LT((slam->covariances().at(5).of_X_WM - expected).norm(), 0.02 * expected.norm());
}

TEST(SlamTest, CovariancesOfAllPlacesAreTheGraphs) {
  const Mission mission(10, 4);
  SlamSettings settings;
  settings.slam.loop_closures = false;
  Slam slam(settings);
  for (SubmapId newest = 0; newest < 60; ++newest) {
    auto submap = std::make_shared<Submap>(*mission.submaps[newest == 0 ? 0 : 1 + newest % 3]);
    submap->base.id = newest;
    slam.AddSubmap(submap);
    if (newest < 50) continue;
    ASSERT_EQ(slam.covariances().size(), newest + 1u);
    const auto exact = slam.BodyCovariances({{0, newest}, {30, newest}, {newest - 1, newest}});
    EXPECT_LT((slam.covariances().at(newest).of_X_WM - exact[0]).norm(), 1e-6 * exact[0].norm());
    EXPECT_LT((slam.covariances().at(30).of_X_MN - exact[1]).norm(), 1e-3 * exact[1].norm());
    EXPECT_LT((slam.covariances().at(newest - 1).of_X_MN - exact[2]).norm(),
              1e-6 * exact[2].norm());
    EXPECT_LT(slam.covariances().at(newest).of_X_MN.norm(), 1e-12);
  }
}

// In the one room a few submaps hold all that there is to see. The others still find their places.
TEST(SlamTest, ClosesLoopsWithNoMoreSubmapsThanHoldAll) {
  const Mission mission(2, 24);
  SlamSettings settings;
  settings.loop_closure.enough_targets = 4;
  const auto slam = SlamOf(mission, settings);
  std::set<SubmapId> targets, joined;
  for (const Slam::Closure& closure : slam->closures()) {
    targets.insert(closure.loop.from);
    if (closure.loop.accepted) joined.insert(closure.loop.to);
  }
  EXPECT_GE(targets.size(), 4u);
  EXPECT_LE(targets.size(), 12u);
  EXPECT_GT(joined.size(), 20u);
  EXPECT_LT(mission.ErrorOf(slam->X_WM()), 0.4 * mission.ErrorOf(mission.Odometry()));
}

// In mid-mission all is known of a motion is that it was some metres at most: the reckoning says it
// stood still, but it moved 3 m.
TEST(SlamTest, FindsItselfAgainAfterAMotionThatNothingMeasured) {
  for (int seed = 1; seed <= 4; ++seed) {
    Mission mission(seed);
    const Vec3 moved(seed % 2 == 0 ? 3 : -2, seed < 3 ? 1 : -2, 0);
    for (auto& submap : mission.submaps)
      if (submap->id() >= 10) submap->base.odometry.X_OB.translation() += moved;
    auto& edge = mission.submaps[10]->base.edge;
    edge.X_PM =
        Ominus(mission.submaps[9]->base.odometry.X_OB, mission.submaps[10]->base.odometry.X_OB);
    edge.covariance.diagonal().head<2>().setConstant(2.0 * 2.0);
    ASSERT_GT(mission.ErrorOf(mission.Odometry()), 0.8);
    const auto slam = SlamOf(mission);
    EXPECT_LT(mission.ErrorOf(slam->X_WM()), 0.1) << seed;
  }
}

/// An upright cylinder around (x, y), which tells no heading.
std::vector<Rectangle> Drum(double x_m, double y_m) {
  constexpr int kSides = 24;
  constexpr double kRadius_m = 0.7, kHeight_m = 1.2;
  std::vector<Rectangle> sides;
  const auto corner = [&](int side) {
    const double angle = 2 * EIGEN_PI * side / kSides;
    return Vec3(x_m + kRadius_m * std::cos(angle), y_m + kRadius_m * std::sin(angle),
                -kHeight_m / 2);
  };
  for (int side = 0; side < kSides; ++side)
    sides.push_back({corner(side), corner(side + 1) - corner(side), {0, 0, kHeight_m}});
  return sides;
}

/// Submaps 0 and 1 see what they are given, the next three nothing but water, while the reckoning
/// goes astray by two metres; the last one stands where the first did.
std::unique_ptr<Slam> SlamThatSeesAgain(const std::vector<std::vector<Rectangle>>& seen) {
  auto slam = std::make_unique<Slam>(SlamSettings());
  const Pose3 drift = Exp(Twist(0.5, 0.35, 0, 0, 0, 0));
  for (SubmapId id = 0; id < 6; ++id) {
    const std::vector<Rectangle> sees = id < 2   ? seen[static_cast<std::size_t>(id)]
                                        : id < 5 ? std::vector<Rectangle>{}
                                                 : seen[0];
    auto submap = SubmapOf(id, sees, Pose3::Identity());
    const bool drifts = id >= 2;
    const double sigma_m = drifts ? 0.6 : 0.05;
    submap->base.edge.X_PM = drifts ? drift : Pose3::Identity();
    submap->base.edge.covariance =
        Twist(sigma_m * sigma_m, sigma_m * sigma_m, 1e-6, 1e-6, 1e-6, 1e-4).asDiagonal();
    slam->AddSubmap(submap);
  }
  return slam;
}

// A moored mine, a single pile: no registration with them determines all.
TEST(SlamTest, FindsARoundThingAgainFarFromWhereItShouldBe) {
  const auto slam = SlamThatSeesAgain({Drum(2, 0), {}});
  EXPECT_EQ(Accepted(*slam), 1);
  EXPECT_EQ(slam->closures().back().loop.constraint.kind, ConstraintKind::kPartialClosure);
  EXPECT_LT(slam->X_WM().at(5).translation().norm(), 0.15);
}

TEST(SlamTest, DoesNotChooseAmongThingsThatLookTheSame) {
  const auto slam = SlamThatSeesAgain({Drum(2, 0), Drum(2, 2.5)});
  EXPECT_EQ(Accepted(*slam), 0);
  EXPECT_EQ(slam->closures().back().loop.reason, "more than one place fits");
  EXPECT_GT(slam->X_WM().at(5).translation().norm(), 2);
}

// Once around the room, where nothing was joined yet, and then one that stands where the first did.
TEST(SlamTest, RevisitsDoWhatIsExpectedOfThem) {
  const Mission mission(3);
  SlamSettings settings;
  settings.loop_closure.min_separation = 8;
  Slam slam(settings);
  const auto mean_sigma_m = [&] {
    double sum_m = 0;
    for (SubmapId id = 0; id < 8; ++id)
      sum_m += std::sqrt(slam.covariances().at(id).of_X_WM.topLeftCorner<2, 2>().trace());
    return sum_m / 8;
  };
  for (SubmapId id = 0; id < 8; ++id) slam.AddSubmap(mission.submaps[id]);
  ASSERT_EQ(slam.ExpectedRevisits().count(0), 1u);
  const double expected = slam.ExpectedRevisits().at(0), before_m = mean_sigma_m();
  EXPECT_GT(expected, 0.15);
  slam.AddSubmap(mission.submaps[8]);
  ASSERT_EQ(Accepted(slam), 1);
  // On the way there it drifted once more.
  EXPECT_NEAR(1 - mean_sigma_m() / before_m, expected, 0.3 * expected);
  const auto still = slam.ExpectedRevisits();
  EXPECT_LT(still.count(0) > 0 ? still.at(0) : 0, 0.5 * expected);
  settings.slam.loop_closures = false;
  EXPECT_TRUE(SlamOf(mission, settings)->ExpectedRevisits().empty());
}

// Each wall of a room seen by a submap of its own, all by the last one.
TEST(SlamTest, ClosesALoopWithSubmapsThatTellItsPlaceOnlyTogether) {
  const std::vector<Rectangle> walls = {{{3, -3, -1}, {0, 6, 0}, {0, 0, 2}},
                                        {{-3, 3, -1}, {6, 0, 0}, {0, 0, 2}},
                                        {{-3, -3, -1}, {0, 6, 0}, {0, 0, 2}},
                                        {{-3, -3, -1}, {6, 0, 0}, {0, 0, 2}}};
  const Pose3 drift = Exp(Twist(0.2, -0.25, 0, 0, 0, 0.02));
  for (const int region_submaps : {1, 4}) {
    SlamSettings settings;
    settings.loop_closure.region_submaps = region_submaps;
    Slam slam(settings);
    Pose3 X_WP = Pose3::Identity(), X_WM = Pose3::Identity();
    for (SubmapId id = 0; id < 5; ++id, X_WP = X_WM) {
      const bool is_last = id == 4;
      X_WM = MakePose({0.2 * id, 0.1 * id, 0}, {0, 0, 0.1 * id});
      auto submap = SubmapOf(id, is_last ? walls : std::vector<Rectangle>{walls[id]}, X_WM);
      submap->base.edge.X_PM = Ominus(X_WP, X_WM) * (is_last ? drift : Pose3::Identity());
      const double sigma_m = is_last ? 0.3 : 0.02;
      submap->base.edge.covariance =
          Twist(sigma_m * sigma_m, sigma_m * sigma_m, 1e-6, 1e-6, 1e-6, sigma_m * sigma_m / 100)
              .asDiagonal();
      slam.AddSubmap(submap);
    }
    const double error_m = (slam.X_WM().at(4).translation() - X_WM.translation()).norm();
    EXPECT_EQ(Accepted(slam), region_submaps > 1 ? 1 : 0);
    EXPECT_EQ((error_m < 0.06), (region_submaps > 1)) << error_m;
    for (const Slam::Closure& closure : slam.closures()) {
      if (!closure.loop.accepted) continue;
      EXPECT_EQ(closure.loop.constraint.kind, ConstraintKind::kFullClosure);
      EXPECT_EQ(closure.loop.to, 4);
    }
  }
}

// A simulated drift of zero gives edges without variance in x, y and yaw.
TEST(SlamTest, TakesEdgesWithoutVariance) {
  const Mission mission(8, 6, 0, 0);
  const auto slam = SlamOf(mission);
  EXPECT_LT(mission.ErrorOf(slam->X_WM()), 1e-3);
}

}  // namespace
}  // namespace vog
