#include "sim/scene/seafloor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "lib/base/random.h"
#include "sim/scene/seabed.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;

/// The circle that a thing takes up.
struct Spot {
  Vec3 middle_W;  ///< On the floor.
  double radius_m;
};

/// Finds places for things, one after the other.
class Placement {
 public:
  Placement(const SeafloorOptions& options, const Seabed& bed) : options_(options), bed_(bed) {}

  /// A free circle. @throws UsageError that names `option` when none is found.
  Spot Find(double radius_m, const char* option, Random& random) {
    constexpr int kTries = 1000;
    for (int i = 0; i < kTries; ++i) {
      const double x = AnyPlace(options_.clutter_length_m, radius_m, random);
      const double y = AnyPlace(options_.clutter_breadth_m, radius_m, random);
      const Spot spot{{x, y, bed_.HeightAt(x, y)}, radius_m};
      if (!IsFree(spot)) continue;
      taken_.push_back(spot);
      return spot;
    }
    throw UsageError("scene.seafloor." + std::string(option) +
                     ": no room for all of them; ask for fewer, or for more clutter_length_m");
  }

 private:
  static double AnyPlace(double size_m, double radius_m, Random& random) {
    const double reach_m = std::max(0.0, 0.5 * size_m - radius_m);
    return random.Uniform(-reach_m, reach_m);
  }

  bool IsFree(const Spot& spot) const {
    return std::none_of(taken_.begin(), taken_.end(), [&](const Spot& other) {
      return (spot.middle_W - other.middle_W).head<2>().norm() <
             spot.radius_m + other.radius_m + options_.gap_m;
    });
  }

  const SeafloorOptions& options_;
  const Seabed& bed_;
  std::vector<Spot> taken_;
};

/// A part of the largest size: half of it at least.
double SizeUpTo(double largest_m, Random& random) { return random.Uniform(0.5, 1) * largest_m; }

/// A dented ellipsoid that is flatter than wide.
TriangleMesh MakeBoulder(const SeafloorOptions& options, Placement& placement, Random random) {
  constexpr double kDents = 0.2, kSunk = 0.3;
  const double radius_m = 0.5 * SizeUpTo(options.boulder_diameter_m, random);
  const double height = random.Uniform(0.55, 0.9), breadth = random.Uniform(0.65, 1);
  const Vec3 half_m = radius_m * Vec3(1, breadth, height) / (1 + kDents);
  const Spot spot = placement.Find(radius_m, "boulders", random);
  const Pose3 X_WA = MakePose(spot.middle_W + Vec3(0, 0, (1 - 2 * kSunk) * half_m.z()),
                              {0, 0, random.Uniform(-kPi, kPi)});
  const Waves dents(kDents, 2, Waves::Directions::kAll, random);
  TriangleMesh boulder = Sphere(Vec3::Zero(), 1, 0.3);
  for (Vec3& p : boulder.vertices) p = X_WA * ((1 + dents.At(p)) * p.cwiseProduct(half_m));
  return boulder;
}

TriangleMesh MakeBox(const SeafloorOptions& options, Placement& placement, Random random) {
  constexpr double kTilt_rad = 0.25, kSunk = 0.25;
  const double length_m = SizeUpTo(options.box_m, random);
  const double height = random.Uniform(0.5, 1), breadth = random.Uniform(0.5, 1);
  const Vec3 size_m = length_m * Vec3(1, breadth, height);
  const Spot spot = placement.Find(0.5 * size_m.head<2>().norm(), "boxes", random);
  const double roll = random.Uniform(-kTilt_rad, kTilt_rad);
  const double pitch = random.Uniform(-kTilt_rad, kTilt_rad);
  const double yaw = random.Uniform(-kPi, kPi);
  return Box(MakePose(spot.middle_W + Vec3(0, 0, (0.5 - kSunk) * size_m.z()), {roll, pitch, yaw}),
             size_m);
}

/// Lies on the floor under both of its ends, and a bit in it.
TriangleMesh MakePipe(const SeafloorOptions& options, const Seabed& bed, Placement& placement,
                      Random random) {
  constexpr int kPoints = 20;
  constexpr double kSunk = 0.3, kWall = 0.2;
  const double length_m = SizeUpTo(options.pipe_length_m, random);
  const double radius_m = 0.5 * SizeUpTo(options.pipe_diameter_m, random);
  const Spot spot = placement.Find(0.5 * length_m, "pipes", random);
  const double heading = random.Uniform(-kPi, kPi);
  const auto end_W = [&](double along_m) {
    const Vec3 p_W = spot.middle_W + along_m * Vec3(std::cos(heading), std::sin(heading), 0);
    return Vec3(p_W.x(), p_W.y(), bed.HeightAt(p_W.x(), p_W.y()) + (1 - 2 * kSunk) * radius_m);
  };
  return Tube(end_W(-0.5 * length_m), end_W(0.5 * length_m), radius_m, kWall * radius_m, kPoints,
              options.max_edge_m);
}

}  // namespace

void SeafloorOptions::Validate() const {
  if (clutter_length_m > length_m || clutter_breadth_m > breadth_m)
    throw UsageError("scene.seafloor.clutter_length_m and clutter_breadth_m must lie on the floor");
  if (pipe_diameter_m > pipe_length_m)
    throw UsageError("scene.seafloor.pipe_diameter_m must not be larger than pipe_length_m");
}

TriangleMesh GenerateSeafloor(const SeafloorOptions& options, std::int64_t seed) {
  options.Validate();
  const Seabed bed(0, options.relief_m, options.wavelength_m, seed);
  const Eigen::Vector2d half_m = 0.5 * Eigen::Vector2d(options.length_m, options.breadth_m);
  TriangleMesh mesh = bed.Slab({-half_m, half_m}, options.max_edge_m);
  Placement placement(options, bed);
  const auto stream = [&](const char* name, int number) {
    return Random(static_cast<std::uint64_t>(seed), name, number);
  };
  // The largest first, while there is most room.
  for (int i = 0; i < options.pipes; ++i)
    mesh.Append(MakePipe(options, bed, placement, stream("scene pipe", i)));
  for (int i = 0; i < options.boxes; ++i)
    mesh.Append(MakeBox(options, placement, stream("scene box", i)));
  for (int i = 0; i < options.boulders; ++i)
    mesh.Append(MakeBoulder(options, placement, stream("scene boulder", i)));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
