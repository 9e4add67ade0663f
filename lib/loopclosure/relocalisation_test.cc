#include "lib/loopclosure/relocalisation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lib/loopclosure/submaps_testing.h"

namespace vog {
namespace {

const IcpOptions kIcp;

SubmapShape ShapeOf(const SubmapPtr& submap) { return SubmapShape(submap, {}, 0, {}, kIcp); }

Mat6 Uncertain(double sigma_x_m, double sigma_y_m) {
  return Twist(sigma_x_m * sigma_x_m, sigma_y_m * sigma_y_m, 1e-4, 1e-5, 1e-5, 1e-4).asDiagonal();
}

std::vector<Pose3> StartsOf(const std::vector<SearchPlace>& places) {
  std::vector<Pose3> starts;
  for (const SearchPlace& place : places) starts.push_back(place.X_ik);
  return starts;
}

TEST(RelocalisationTest, SigmaIsThatOfTheWorstHorizontalDirection) {
  EXPECT_NEAR(HorizontalSigma(Uncertain(0.3, 0.1)), 0.3, 1e-12);
  Mat6 turned = Uncertain(0.3, 0.1);
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  turned.topLeftCorner<2, 2>() = R * turned.topLeftCorner<2, 2>() * R.transpose();
  EXPECT_NEAR(HorizontalSigma(turned), 0.3, 1e-12);
  EXPECT_FALSE(IsLost(kIcp, 0.3));
  EXPECT_TRUE(IsLost(kIcp, 3));
}

TEST(RelocalisationTest, PlacesAreTheBestOfTheEllipseBestFirst) {
  const SubmapShape target = ShapeOf(SubmapOf(3, FurnishedRoom(), Pose3::Identity()));
  const SubmapShape source = ShapeOf(SubmapOf(9, FurnishedRoom(), MakePose({0.5, 0, 0}), 3));
  const Pose3 predicted = MakePose({2, 1, 0}, {0, 0, 0.3});
  const auto places = SearchPlaces(kIcp, target, source, predicted, Uncertain(1.5, 0.1));
  ASSERT_FALSE(places.empty());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 shift = Ominus(predicted, places[i].X_ik).translation();
    EXPECT_LE(std::abs(shift.x()), 2 * 1.5 + 1e-9);
    EXPECT_LE(std::abs(shift.y()), 2 * 0.1 + 1e-9);
    EXPECT_EQ(shift.z(), 0);
    EXPECT_LE(places[i].overlap, places[i == 0 ? 0 : i - 1].overlap);
  }
}

// The room seen from places whose relative pose is known to metres only.
TEST(RelocalisationTest, FindsWhatARegistrationFromThePredictionMisses) {
  const Pose3 X_Wi = MakePose({-0.5, 0.3, 0}, {0, 0, 0.4});
  const Pose3 X_Wk = MakePose({0.6, -0.4, 0}, {0, 0, -0.5});
  const SubmapShape target = ShapeOf(SubmapOf(3, FurnishedRoom(), X_Wi));
  const SubmapShape source = ShapeOf(SubmapOf(9, FurnishedRoom(), X_Wk));
  const Pose3 X_ik = Ominus(X_Wi, X_Wk);
  int missed = 0;
  for (const double angle : {0.2, 1.3, 2.4, 3.5, 4.6, 5.7}) {
    const Pose3 predicted = X_ik * MakePose({3 * std::cos(angle), 3 * std::sin(angle), 0});
    const Mat6 P = Uncertain(2, 2);
    const IcpResult alone = Register(kIcp, target.cloud, source.cloud, predicted);
    missed += (alone.X_ik.translation() - X_ik.translation()).norm() > 0.3;
    const SearchResult found = RegisterFrom(
        kIcp, target, source, StartsOf(SearchPlaces(kIcp, target, source, predicted, P)));
    EXPECT_TRUE(found.registration.usable) << angle;
    EXPECT_LT((found.registration.X_ik.translation() - X_ik.translation()).norm(), 0.05) << angle;
    EXPECT_FALSE(found.is_ambiguous) << angle;
  }
  EXPECT_GE(missed, 5);
}

TEST(RelocalisationTest, EqualPlacesAreAmbiguous) {
  std::vector<Rectangle> row = {{{-12, 2, -1}, {24, 0, 0}, {0, 0, 2}}};
  for (int i = -4; i <= 4; ++i) {
    row.push_back({{2.4 * i, 1.2, -1}, {0, 0.8, 0}, {0, 0, 2}});
    row.push_back({{2.4 * i, 1.2, -1}, {0.6, 0, 0}, {0, 0, 2}});
  }
  const SubmapShape target = ShapeOf(SubmapOf(3, row, Pose3::Identity(), 9));
  const SubmapShape source = ShapeOf(SubmapOf(9, row, MakePose({0.3, 0, 0}), 3));
  const Pose3 predicted = MakePose({1.5, 0, 0});
  const auto places = SearchPlaces(kIcp, target, source, predicted, Uncertain(2, 0.05));
  EXPECT_TRUE(RegisterFrom(kIcp, target, source, StartsOf(places)).is_ambiguous);
}

}  // namespace
}  // namespace vog
