#pragma once

#include <cmath>
#include <vector>

#include "lib/base/random.h"
#include "lib/geometry/pose.h"

/// Clouds and motions for tests.
namespace vog {

/// A flat piece of surface: `corner` and its two sides.
struct Rectangle {
  Vec3 corner, along, up;
};

/// Points spread at random over rectangles, one for each `spacing_m`^2. Two streams give two
/// samplings without a common point.
inline std::vector<Vec3> SampleRectangles(const std::vector<Rectangle>& rectangles,
                                          double spacing_m, Random random) {
  std::vector<Vec3> points;
  for (const Rectangle& r : rectangles) {
    const double area_m2 = r.along.cross(r.up).norm();
    const int count = static_cast<int>(std::lround(area_m2 / (spacing_m * spacing_m)));
    for (int i = 0; i < count; ++i)
      points.push_back(r.corner + random.Uniform(0, 1) * r.along + random.Uniform(0, 1) * r.up);
  }
  return points;
}

/// What a vehicle at the origin sees of a corner of two walls with a box in front of it. No two
/// directions are alike, so that a cloud of it has one best place.
inline std::vector<Rectangle> CornerWithBox() {
  return {{{4, -3, -1}, {0, 6, 0}, {0, 0, 2}},
          {{-2, 3, -1}, {6, 0, 0}, {0, 0, 2}},
          {{1.4, -2.2, -1}, {0, 0.9, 0}, {0, 0, 1.4}},
          {{1.4, -1.3, -1}, {0.7, 0, 0}, {0, 0, 1.4}}};
}

inline Rectangle Floor() { return {{-2, -3, -1}, {6, 0, 0}, {0, 6, 0}}; }

inline std::vector<Vec3> Transformed(const Pose3& X, std::vector<Vec3> points) {
  for (Vec3& p : points) p = X * p;
  return points;
}

inline std::vector<Vec3> WithNoise(std::vector<Vec3> points, double sigma_m, Random random) {
  for (Vec3& p : points) p += random.GaussianVector(Vec3::Constant(sigma_m));
  return points;
}

/// A motion whose six coordinates are uniform within +-`limits` (x, y, z, roll, pitch, yaw).
inline Pose3 RandomMotion(const Vec6& limits, Random& random) {
  Vec6 xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.Uniform(-1, 1) * limits[i];
  return Exp(xi);
}

inline Vec6 Twist(double x, double y, double z, double roll, double pitch, double yaw) {
  Vec6 xi;
  xi << x, y, z, roll, pitch, yaw;
  return xi;
}

}  // namespace vog
