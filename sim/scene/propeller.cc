#include "sim/scene/propeller.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kAround = 32;         // Corners of the hub and the shaft.
constexpr int kFoilPoints = 24;     // Corners of a foil's outline.
constexpr int kBladeStations = 18;  // Sections of a blade.

/// A point of a foil: along the chord, leading edge 0 and trailing edge 1, and to one side.
struct FoilPoint {
  double along, side;
};

/// The outline of a symmetric foil of thickness 1 [Abbott and von Doenhoff 1959, NACA four-digit,
/// with a closed trailing edge], from the leading edge along one side and back along the other.
std::vector<FoilPoint> FoilOutline() {
  std::vector<FoilPoint> outline;
  for (int i = 0; i < kFoilPoints; ++i) {
    const double angle = 2 * kPi * i / kFoilPoints;
    const double x = 0.5 * (1 - std::cos(angle));
    const double half = 5 * (0.2969 * std::sqrt(x) - 0.1260 * x - 0.3516 * x * x +
                             0.2843 * x * x * x - 0.1036 * x * x * x * x);
    outline.push_back({x, angle < kPi ? half : -half});
  }
  return outline;
}

/// Share of the greatest chord at a share `s` of the radius: rising from the root, round at the
/// tip.
double ChordShare(double s) {
  constexpr double kWidest = 0.62, kRoot = 0.55;
  if (s < kWidest) return kRoot + (1 - kRoot) * std::sin(0.5 * kPi * s / kWidest);
  const double outward = (s - kWidest) / (1 - kWidest);
  return std::sqrt(std::max(0.0, 1 - outward * outward));
}

/// A blade's section on the cylinder around the shaft, laid on the blade's helix and unrolled.
Ring BladeSection(const PropellerOptions& options, double radius_m, double blade_angle) {
  constexpr double kTipChord = 0.06, kTipThickness = 0.12;
  const double s = radius_m / options.radius_m;
  const double hub = options.hub_radius_m / options.radius_m;
  const double chord = options.blade_chord_m * std::max(kTipChord, ChordShare(s));
  const double thickness = options.blade_thickness_m * std::max(kTipThickness, 1 - s);
  const double slope = std::atan2(options.pitch_m, 2 * kPi * radius_m);
  const double outward = std::max(0.0, (s - hub) / (1 - hub));
  const double lag = options.skew_deg / 180 * kPi * outward * outward;
  const Vec3 middle(options.disc_x_m - options.pitch_m * lag / (2 * kPi), 0, 0);
  Ring ring;
  for (const FoilPoint& point : FoilOutline()) {
    const double along = chord * (0.5 - point.along), side = thickness * point.side;
    const double x = along * std::sin(slope) + side * std::cos(slope);
    const double arc = along * std::cos(slope) - side * std::sin(slope);
    const double angle = blade_angle - lag + arc / radius_m;
    // A right-handed screw: seen from aft it turns clockwise, from +z over starboard (-y).
    ring.push_back(middle + Vec3(x, -radius_m * std::sin(angle), radius_m * std::cos(angle)));
  }
  return ring;
}

TriangleMesh MakeBlade(const PropellerOptions& options, double blade_angle) {
  const double root_m = 0.8 * options.hub_radius_m;
  std::vector<Ring> rings;
  for (int i = 0; i <= kBladeStations; ++i) {
    // Closer together towards the tip, where the outline bends most.
    const double share = std::sin(0.5 * kPi * i / kBladeStations);
    rings.push_back(
        BladeSection(options, root_m + share * (options.radius_m - root_m), blade_angle));
  }
  return Loft(rings, options.max_edge_m);
}

/// A body of revolution around the shaft's axis.
struct Station {
  double x, radius;
};
TriangleMesh Turn(const PropellerOptions& options, const std::vector<Station>& stations) {
  std::vector<Ring> rings;
  for (const Station& station : stations)
    rings.push_back(Circle({station.x, 0, 0}, Vec3::UnitX(), station.radius, kAround));
  return Loft(rings, options.max_edge_m);
}

/// Hub with a round cap behind it.
TriangleMesh MakeHub(const PropellerOptions& options) {
  constexpr int kCapStations = 6;
  const double r = options.hub_radius_m, half = 0.5 * options.hub_length_m;
  const double aft = options.disc_x_m - half, cap = 1.3 * r;
  std::vector<Station> stations;
  for (int i = 1; i <= kCapStations; ++i) {
    const double angle = 0.5 * kPi * i / kCapStations;
    stations.push_back({aft - cap * std::cos(angle), 0.85 * r * std::sin(angle)});
  }
  stations.push_back({options.disc_x_m, r});
  stations.push_back({options.disc_x_m + half, r});
  return Turn(options, stations);
}

double SternFront(const PropellerOptions& options) { return 0.5 * options.stern_length_m; }

/// Where the skeg ends and the propeller's aperture begins.
double SkegEnd(const PropellerOptions& options) {
  return options.disc_x_m + 0.5 * options.hub_length_m + 0.3;
}

TriangleMesh MakeShaft(const PropellerOptions& options) {
  return Turn(options, {{options.disc_x_m, options.shaft_radius_m},
                        {SternFront(options) - 0.05, options.shaft_radius_m}});
}

/// The swelling of the skeg around the shaft.
TriangleMesh MakeBossing(const PropellerOptions& options) {
  const double r = options.shaft_radius_m, end = SkegEnd(options);
  const double length = SternFront(options) - end;
  return Turn(options, {{end - 0.08, 1.2 * r},
                        {end, 1.35 * r},
                        {end + 0.3 * length, 1.6 * r},
                        {SternFront(options) - 0.02, 1.9 * r}});
}

/// The rudder hangs from the counter: a foil, its lower end shorter and swept.
TriangleMesh MakeRudder(const PropellerOptions& options) {
  constexpr double kGap_m = 0.35, kTaper = 0.82, kImmersed_m = 0.3;
  const double top = options.counter_height_m + kImmersed_m;
  const double bottom = top - options.rudder_height_m;
  const double front =
      options.disc_x_m - 0.5 * options.hub_length_m - 1.3 * options.hub_radius_m - kGap_m;
  std::vector<Ring> rings;
  for (const double share : {0.0, 1.0}) {
    const double chord = options.rudder_chord_m * (1 - (1 - kTaper) * share);
    Ring ring;
    for (const FoilPoint& point : FoilOutline()) {
      const double inset = 0.35 * (options.rudder_chord_m - chord);
      ring.push_back({front - inset - chord * point.along, options.rudder_thickness_m * point.side,
                      top + (bottom - top) * share});
    }
    rings.push_back(ring);
  }
  return Loft(rings, options.max_edge_m);
}

/// A cross section of the hull: its half breadth is `narrow` near the keel and grows to `wide` at
/// the top with (share of the height)^fullness.
struct HullSection {
  double x, keel, narrow, wide, fullness;
};

Ring HullOutline(const HullSection& section, double top) {
  constexpr int kHeights = 16;
  const double crowding = section.fullness < 1 ? 2 : 1;  // A full section bends near its keel.
  Ring ring = {{section.x, 0, section.keel}};
  for (int i = 1; i <= kHeights; ++i) {
    const double share = std::pow(static_cast<double>(i) / kHeights, crowding);
    const double half = std::min(1.0, 8 * share) * section.narrow +
                        (section.wide - section.narrow) * std::pow(share, section.fullness);
    ring.push_back({section.x, -half, section.keel + share * (top - section.keel)});
  }
  for (int i = kHeights; i >= 1; --i) ring.push_back(ring[i].cwiseProduct(Vec3(1, -1, 1)));
  return ring;
}

/// The skeg in front of the propeller and the counter above it: one body from front to aft.
TriangleMesh MakeStern(const PropellerOptions& options) {
  constexpr int kStations = 6;
  constexpr double kPostRake_m = 0.45;
  const double top = 0.5 * options.stern_height_m, keel = -top;
  const double front = SternFront(options), aft = -front, end = SkegEnd(options);
  const double wide = 0.5 * options.stern_breadth_m, narrow = 0.5 * options.skeg_breadth_m;
  std::vector<Ring> rings;
  for (int i = 0; i <= kStations; ++i) {
    const double share = static_cast<double>(i) / kStations;  // From the front to the post.
    const double fin = narrow * (0.12 + 0.88 * (1 - share) * (1 - share));
    rings.push_back(HullOutline(
        {front + (end - front) * share, keel, fin, wide * (1 - 0.04 * share), 4 + 1.5 * share},
        top));
  }
  for (int i = 0; i <= kStations; ++i) {
    const double share = static_cast<double>(i) / kStations;  // From the post to the transom.
    const double bottom =
        options.counter_height_m + 0.45 * (top - options.counter_height_m) * share * share;
    rings.push_back(HullOutline({end - kPostRake_m + (aft - end + kPostRake_m) * share, bottom,
                                 0.12 * narrow, wide * (0.96 - 0.3 * share * share), 0.35},
                                top));
  }
  return Loft(rings, options.max_edge_m);
}

}  // namespace

void PropellerOptions::Validate() const {
  if (hub_radius_m >= 0.8 * radius_m)
    throw UsageError("scene.propeller.hub_radius_m leaves no room for blades");
  if (shaft_radius_m >= hub_radius_m)
    throw UsageError("scene.propeller.shaft_radius_m must be smaller than hub_radius_m");
  if (counter_height_m >= 0.5 * stern_height_m)
    throw UsageError("scene.propeller.counter_height_m must be below half of stern_height_m");
  if (SkegEnd(*this) >= SternFront(*this) - 0.2)
    throw UsageError("scene.propeller.stern_length_m leaves no room for the skeg");
}

TriangleMesh GeneratePropeller(const PropellerOptions& options) {
  options.Validate();
  TriangleMesh mesh;
  for (int i = 0; i < options.blades; ++i)
    mesh.Append(MakeBlade(options, 2 * kPi * i / options.blades));
  mesh.Append(MakeHub(options));
  mesh.Append(MakeShaft(options));
  mesh.Append(MakeBossing(options));
  mesh.Append(MakeRudder(options));
  mesh.Append(MakeStern(options));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
