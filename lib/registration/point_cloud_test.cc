#include "lib/registration/point_cloud.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "lib/registration/clouds_testing.h"

namespace vog {
namespace {

constexpr double kRadius_m = 0.3;

double AngleBetween(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(RegistrationCloudTest, NormalsOfAPlaneAreItsOwnTowardsTheViewer) {
  const std::vector<Vec3> points =
      SampleRectangles({{{2, -1, -1}, {0, 2, 0.5}, {0.3, 0, 2}}}, 0.1, Random(1, "cloud"));
  const Vec3 normal = Vec3(0, 2, 0.5).cross(Vec3(0.3, 0, 2)).normalized();
  for (const double side : {1.0, -1.0}) {
    const RegistrationCloud dut(points, kRadius_m, Vec3(2, 0, 0) + 3 * side * normal);
    for (const LocalPlane& plane : dut.planes())
      EXPECT_LT(AngleBetween(plane.normal, side * normal), 1e-6);
  }
}

TEST(RegistrationCloudTest, NormalsOfASphereAreItsRadii) {
  Random random(2, "cloud");
  const Vec3 center(1, -2, 0.5);
  std::vector<Vec3> points;
  for (int i = 0; i < 4000; ++i)
    points.push_back(center + 2 * random.GaussianVector(Vec3::Ones()).normalized());
  const RegistrationCloud inside(points, kRadius_m, center);
  const Vec3 viewer = center + Vec3(10, 0, 0);
  const RegistrationCloud outside(points, kRadius_m, viewer);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 radius = (points[i] - center).normalized();
    EXPECT_LT(AngleBetween(inside.planes()[i].normal, -radius), 0.1);
    EXPECT_GE(outside.planes()[i].normal.dot(viewer - points[i]), 0);
    // The far side is turned to the viewer, too: a cloud does not know what hides what.
    EXPECT_GT(std::abs(outside.planes()[i].normal.dot(radius)), std::cos(0.1));
  }
}

TEST(RegistrationCloudTest, PointsWithoutAPlaneHaveNoNormal) {
  Random random(3, "cloud");
  std::map<std::string, std::vector<Vec3>> clouds;
  clouds["few"] = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0.1, 0.1, 0}};
  clouds["same"] = std::vector<Vec3>(20, Vec3(1, 1, 1));
  for (int i = 0; i < 50; ++i) {
    clouds["lonely"].push_back({static_cast<double>(i), 0, 0});
    clouds["line"].push_back(0.095 * i * Vec3(1, 2, -1).normalized());
  }
  for (int i = 0; i < 300; ++i)
    clouds["ball"].push_back(0.1 * random.GaussianVector(Vec3::Ones()).normalized());
  for (const auto& [name, points] : clouds) {
    const RegistrationCloud dut(points, kRadius_m, Vec3(5, 5, 5));
    for (const LocalPlane& plane : dut.planes()) EXPECT_TRUE(plane.normal.isZero()) << name;
  }
}

TEST(RegistrationCloudTest, KeepsItsPointsAndFindsTheNearest) {
  const std::vector<Vec3> points =
      SampleRectangles({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, 0.1, Random(4, "cloud"));
  const RegistrationCloud dut(points, kRadius_m, Vec3(0, 0, 1));
  EXPECT_EQ(dut.points(), points);
  ASSERT_EQ(dut.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(dut.NearestWithin(points[i], 0.1)->index, i);
}

TEST(RegistrationCloudTest, MayBeEmpty) {
  const RegistrationCloud dut({}, kRadius_m, Vec3::Zero());
  EXPECT_EQ(dut.size(), 0u);
  EXPECT_TRUE(dut.planes().empty());
}

}  // namespace
}  // namespace vog
