#include "sim/scene/mine.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/scene/seabed.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree_rad = kPi / 180;

/// Directions spread evenly from the top of the sphere down to 45 degrees below its middle, on a
/// Fibonacci spiral.
Vec3 HornDirection(int number, int count) {
  constexpr double kGolden = std::numbers::phi - 1;
  const double lowest = -std::sqrt(0.5);
  const double z = 1 - (1 - lowest) * number / std::max(1, count - 1);
  const double angle = 2 * kPi * kGolden * number, level = std::sqrt(1 - z * z);
  return {level * std::cos(angle), level * std::sin(angle), z};
}

/// A round bar with a round end.
TriangleMesh MakeHorn(const MineOptions& options, const Vec3& direction) {
  constexpr int kPoints = 12;
  const double sphere_m = 0.5 * options.diameter_m, radius_m = 0.5 * options.horn_diameter_m;
  const Vec3 end_W = (sphere_m + options.horn_length_m - radius_m) * direction;
  TriangleMesh horn = Cylinder((sphere_m - radius_m) * direction, end_W, 0.98 * radius_m, kPoints,
                               options.max_edge_m);
  horn.Append(Sphere(end_W, radius_m, radius_m));
  return horn;
}

/// C: the chain from the sphere's underside, x along it.
Pose3 ChainPose(const MineOptions& options) {
  const double bearing = options.chain_bearing_deg * kDegree_rad;
  const double down = 0.5 * kPi - options.chain_lean_deg * kDegree_rad;
  const Pose3 X_WC = MakePose(Vec3::Zero(), {0, down, bearing});
  return X_WC * MakePose({0.5 * options.diameter_m, 0, 0});
}

/// An oval ring of round bar, its length along x of L, flat in L's x-y plane.
TriangleMesh MakeLink(const MineOptions& options, const Pose3& X_WL) {
  constexpr int kSteps = 16, kPoints = 8;
  const double bar_m = 0.5 * options.link_bar_m;
  const double a = 0.5 * options.link_length_m - bar_m, b = 0.6 * a;
  std::vector<Ring> rings;
  for (int i = 0; i < kSteps; ++i) {
    const double t = 2 * kPi * i / kSteps;
    const Vec3 middle(a * std::cos(t), b * std::sin(t), 0);
    const Vec3 outward = Vec3(b * std::cos(t), a * std::sin(t), 0).normalized();
    Ring ring;
    for (int k = 0; k < kPoints; ++k) {
      const double angle = 2 * kPi * k / kPoints;
      ring.push_back(
          X_WL * (middle + bar_m * (std::cos(angle) * outward + std::sin(angle) * Vec3::UnitZ())));
    }
    rings.push_back(std::move(ring));
  }
  return Loop(rings, options.max_edge_m);
}

/// Links that hang in each other, each turned by a quarter. The first and the last reach into
/// sphere and sinker.
TriangleMesh MakeChain(const MineOptions& options) {
  const double pitch_m = options.link_length_m - 2 * options.link_bar_m;
  const int links = static_cast<int>(std::ceil(options.chain_length_m / pitch_m));
  TriangleMesh chain;
  for (int i = 0; i < links; ++i) {
    const double x = options.chain_length_m * (i + 0.5) / links;
    chain.Append(
        MakeLink(options, ChainPose(options) * MakePose({x, 0, 0}, {i % 2 * 0.5 * kPi, 0, 0})));
  }
  return chain;
}

/// The middle of the sinker's top, where the chain ends.
Vec3 SinkerTop(const MineOptions& options) {
  return ChainPose(options) * Vec3(options.chain_length_m, 0, 0);
}

/// A square block, narrower at its top.
TriangleMesh MakeSinker(const MineOptions& options) {
  const Vec3 top_W = SinkerTop(options);
  const double corner_m = options.sinker_size_m * std::sqrt(0.5);
  return Loft({Circle(top_W - Vec3(0, 0, options.sinker_height_m), Vec3::UnitZ(), corner_m, 4),
               Circle(top_W, Vec3::UnitZ(), 0.8 * corner_m, 4)},
              options.max_edge_m);
}

/// Takes in the sinker's foot.
TriangleMesh MakeFloor(const MineOptions& options) {
  const double level_m = SinkerTop(options).z() - 0.9 * options.sinker_height_m;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * options.floor_size_m);
  return Seabed(level_m, 0, options.floor_size_m, 0).Slab({-half, half}, options.max_edge_m);
}

}  // namespace

void MineOptions::Validate() const {
  if (horn_diameter_m >= 0.5 * diameter_m)
    throw UsageError("scene.mine.horn_diameter_m must be smaller than half of diameter_m");
  if (horn_length_m <= horn_diameter_m)
    throw UsageError("scene.mine.horn_length_m must be larger than horn_diameter_m");
  if (link_bar_m > 0.2 * link_length_m)
    throw UsageError("scene.mine.link_bar_m leaves no opening in a link of link_length_m");
}

TriangleMesh GenerateMine(const MineOptions& options) {
  options.Validate();
  TriangleMesh mesh = Sphere(Vec3::Zero(), 0.5 * options.diameter_m, 0.15 * options.diameter_m);
  for (int i = 0; i < options.horns; ++i)
    mesh.Append(MakeHorn(options, HornDirection(i, options.horns)));
  mesh.Append(MakeChain(options));
  mesh.Append(MakeSinker(options));
  if (options.floor) mesh.Append(MakeFloor(options));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
