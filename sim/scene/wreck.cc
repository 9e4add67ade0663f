#include "sim/scene/wreck.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lib/base/random.h"
#include "sim/scene/seabed.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree_rad = kPi / 180;
constexpr double kCell_m = 0.2;  // Of the plates' grids: how round a hole can be.

/// The ship's lines in its own frame H: x forward from amidships, y to port, z up from half of the
/// depth. Stations run from 0 at the break to 1 at the bow, heights from 0 at the keel to 1 at the
/// gunwale. A section is a superellipse: full amidships, hollow at the bow.
class HullLines {
 public:
  explicit HullLines(const WreckOptions& options) : options_(options) {}

  double X(double station, double height) const {
    constexpr double kRake = 0.3;  // Of the stem, as a share of the depth.
    return options_.length_m * (station - 0.5) +
           kRake * options_.depth_m * height * std::pow(station, 4);
  }

  double Top(double station) const {
    constexpr double kSheer = 0.15;
    return options_.depth_m * (0.5 + kSheer * station * station);
  }

  double HalfBreadth(double station, double height) const {
    const double n = Fullness(station);
    return HalfBreadthAtTop(station) * std::pow(1 - std::pow(1 - height, n), 1 / n);
  }

  double HeightOf(double station, double z) const { return (z - Keel()) / (Top(station) - Keel()); }

  /// On the outer side of the shell, or `inset_m` further in. `angle` runs around the section from
  /// the starboard gunwale (-pi/2) over the keel to the port one.
  Vec3 ShellPoint(double station, double angle, double inset_m) const {
    const double n = Fullness(station);
    const double s = std::abs(std::sin(angle)), c = std::abs(std::cos(angle));
    const double r = std::pow(std::pow(s, n) + std::pow(c, n), -1 / n);
    const double height = 1 - r * c;
    const double half_m = HalfBreadthAtTop(station) * (1 - inset_m / (0.5 * options_.breadth_m));
    const double keel_m = Keel() + inset_m;
    return {X(station, height), std::copysign(half_m * r * s, angle),
            keel_m + height * (Top(station) - keel_m)};
  }

  double Keel() const { return -0.5 * options_.depth_m; }

 private:
  static constexpr double kMidship = 0.5;  // Where the bow begins.

  /// The exponent of the section's superellipse.
  static double Fullness(double station) {
    const double forward = std::max(0.0, (station - kMidship) / (1 - kMidship));
    return 3.6 - 2.2 * forward;
  }

  double HalfBreadthAtTop(double station) const {
    constexpr double kAtBow = 0.06;
    const double forward = std::max(0.0, (station - kMidship) / (1 - kMidship));
    return 0.5 * options_.breadth_m * (1 - (1 - kAtBow) * forward * forward);
  }

  const WreckOptions& options_;
};

/// An opening of the ship's side. Elliptic, seen from abeam.
struct SideHole {
  double x, z, half_length_m, half_height_m;
  bool is_port;

  bool Contains(const Vec3& p_H) const {
    return (p_H.y() > 0) == is_port &&
           std::hypot((p_H.x() - x) / half_length_m, (p_H.z() - z) / half_height_m) < 1;
  }
};

/// Holes in a row along the ship, starboard and port in turn, somewhat off their regular places.
void AddHoles(const WreckOptions& options, int count, double length_m, double height_m,
              Random random, std::vector<SideHole>& holes) {
  constexpr double kFrom = -0.32, kTo = 0.25;  // Shares of the length.
  const double step = (kTo - kFrom) / std::max(1, count);
  for (int i = 0; i < count; ++i) {
    const double x = options.length_m * (kFrom + step * (i + random.Uniform(0.3, 0.7)));
    const double z = options.depth_m * random.Uniform(-0.02, 0.12);
    holes.push_back({x, z, 0.5 * length_m, 0.5 * height_m, i % 2 == 1});
  }
}

std::vector<SideHole> PlaceHoles(const WreckOptions& options, std::int64_t seed) {
  const auto number = static_cast<std::uint64_t>(seed);
  std::vector<SideHole> holes;
  AddHoles(options, options.breaches, options.breach_m, 0.7 * options.breach_m,
           Random(number, "scene breaches"), holes);
  AddHoles(options, options.holes, options.hole_m, options.hole_m, Random(number, "scene holes"),
           holes);
  return holes;
}

/// The station where the ship broke, for each column of a plate: a random walk.
std::vector<double> BreakOf(const WreckOptions& options, int columns, Random random) {
  const double most = options.ragged_m / options.length_m;
  std::vector<double> stations;
  double station = 0.5 * most;
  for (int i = 0; i < columns; ++i) {
    station = std::clamp(station + random.Uniform(-0.35, 0.35) * most, 0.0, most);
    stations.push_back(station);
  }
  return stations;
}

int CellsOver(double length_m) { return std::max(4, static_cast<int>(length_m / kCell_m)); }

TriangleMesh MakeShell(const WreckOptions& options, std::int64_t seed) {
  const HullLines lines(options);
  const std::vector<SideHole> holes = PlaceHoles(options, seed);
  PlateGrid grid;
  grid.rows = CellsOver(options.length_m);
  grid.columns = CellsOver(options.breadth_m + 2 * options.depth_m);
  const std::vector<double> break_stations =
      BreakOf(options, grid.columns, Random(static_cast<std::uint64_t>(seed), "scene shell break"));
  const auto at = [&](double row, double column, double inset_m) {
    return lines.ShellPoint(row / grid.rows, kPi * (column / grid.columns - 0.5), inset_m);
  };
  grid.front = [&](int row, int column) { return at(row, column, 0); };
  grid.back = [&](int row, int column) { return at(row, column, options.plate_thickness_m); };
  grid.is_open = [&](int row, int column) {
    const Vec3 p_H = at(row + 0.5, column + 0.5, 0);
    return row + 0.5 < break_stations[column] * grid.rows ||
           std::any_of(holes.begin(), holes.end(),
                       [&](const SideHole& hole) { return hole.Contains(p_H); });
  };
  return Plate(grid);
}

/// A point of the deck, `depth_m` below its upper side. `across` runs from -1 at the middle of the
/// starboard shell's plate to 1 at that of the port one.
Vec3 DeckPoint(const WreckOptions& options, double station, double across, double depth_m) {
  const HullLines lines(options);
  const double z = lines.Top(station) - options.bulwark_m - depth_m;
  const double height = lines.HeightOf(station, z);
  const double half_m =
      lines.HalfBreadth(station, height) * (1 - options.plate_thickness_m / options.breadth_m);
  return {lines.X(station, height), across * half_m, z};
}

/// Fore and aft of the deckhouse.
double DeckhouseX(const WreckOptions& options) {
  return -0.5 * options.length_m + options.ragged_m + 0.6 * options.deckhouse_size_m.x();
}

/// The middles of the hatches, evenly spaced from the deckhouse to where the bow gets narrow.
std::vector<double> HatchPlaces(const WreckOptions& options) {
  const double from = DeckhouseX(options) + 0.5 * options.deckhouse_size_m.x();
  const double to = 0.36 * options.length_m;
  std::vector<double> places;
  places.reserve(options.hatches);
  for (int i = 0; i < options.hatches; ++i)
    places.push_back(from + (to - from) * (i + 0.5) / options.hatches);
  return places;
}

bool IsHatch(const WreckOptions& options, const std::vector<double>& hatches, const Vec3& p_H) {
  const double half_m = 0.5 * options.hatch_m;
  return std::abs(p_H.y()) < half_m && std::any_of(hatches.begin(), hatches.end(), [&](double x) {
           return std::abs(p_H.x() - x) < half_m;
         });
}

TriangleMesh MakeDeck(const WreckOptions& options, std::int64_t seed) {
  constexpr double kBow = 0.98;  // Where the stem takes over.
  const std::vector<double> hatches = HatchPlaces(options);
  PlateGrid grid;
  grid.rows = CellsOver(options.length_m);
  grid.columns = CellsOver(options.breadth_m);
  const std::vector<double> break_stations =
      BreakOf(options, grid.columns, Random(static_cast<std::uint64_t>(seed), "scene deck break"));
  const auto at = [&](double row, double column, double depth_m) {
    return DeckPoint(options, kBow * row / grid.rows, 2 * column / grid.columns - 1, depth_m);
  };
  grid.front = [&](int row, int column) { return at(row, column, 0); };
  grid.back = [&](int row, int column) { return at(row, column, options.plate_thickness_m); };
  grid.is_open = [&](int row, int column) {
    return row + 0.5 < break_stations[column] * grid.rows ||
           IsHatch(options, hatches, at(row + 0.5, column + 0.5, 0));
  };
  return Plate(grid);
}

/// A round bar that closes the shell at the bow.
TriangleMesh MakeStem(const WreckOptions& options) {
  constexpr int kPoints = 16;
  const HullLines lines(options);
  const double radius_m = lines.HalfBreadth(1, 1) + 0.5 * options.plate_thickness_m;
  return Cylinder({lines.X(1, 0), 0, lines.Keel()}, {lines.X(1, 1), 0, lines.Top(1)}, radius_m,
                  kPoints, options.max_edge_m);
}

/// A block, so large that its lower side is under the deck.
TriangleMesh MakeDeckhouse(const WreckOptions& options) {
  const double x = DeckhouseX(options);
  const double deck_m = DeckPoint(options, x / options.length_m + 0.5, 0, 0).z();
  const double sunk_m = 0.5 * options.plate_thickness_m;
  const Vec3 size_m = options.deckhouse_size_m + Vec3(0, 0, sunk_m);
  return Box(MakePose({x, 0, deck_m - sunk_m + 0.5 * size_m.z()}), size_m);
}

/// Before the foremost hatch.
TriangleMesh MakeMast(const WreckOptions& options) {
  constexpr int kPoints = 12;
  constexpr double kStation = 0.88;
  const Vec3 foot_H = DeckPoint(options, kStation, 0, 0.5 * options.plate_thickness_m);
  return Cylinder(foot_H, foot_H + Vec3(-0.1, 0, 1) * options.mast_height_m,
                  0.5 * options.mast_diameter_m, kPoints, options.max_edge_m);
}

TriangleMesh MakeShip(const WreckOptions& options, std::int64_t seed) {
  TriangleMesh ship = MakeShell(options, seed);
  ship.Append(MakeDeck(options, seed));
  ship.Append(MakeStem(options));
  ship.Append(MakeDeckhouse(options));
  ship.Append(MakeMast(options));
  const Pose3 X_WH =
      MakePose(Vec3::Zero(), {options.list_deg * kDegree_rad, options.trim_deg * kDegree_rad, 0});
  for (Vec3& vertex : ship.vertices) vertex = X_WH * vertex;
  return ship;
}

TriangleMesh MakeFloor(const WreckOptions& options, const TriangleMesh& ship_W, std::int64_t seed) {
  const Seabed bed(ship_W.Bounds().min().z() + options.sunk_m, options.floor_relief_m,
                   2 * options.breadth_m, seed);
  return bed.Slab(AreaAround(ship_W, options.floor_margin_m), options.max_edge_m);
}

}  // namespace

void WreckOptions::Validate() const {
  if (plate_thickness_m >= 0.1 * std::min(breadth_m, depth_m))
    throw UsageError("scene.wreck.plate_thickness_m leaves no room in the ship");
  if (bulwark_m >= 0.5 * depth_m)
    throw UsageError("scene.wreck.bulwark_m must be smaller than half of depth_m");
  if (ragged_m >= 0.25 * length_m)
    throw UsageError("scene.wreck.ragged_m must be smaller than a quarter of length_m");
  if (hatch_m >= 0.8 * breadth_m || hatches * hatch_m >= 0.5 * length_m)
    throw UsageError("scene.wreck.hatch_m leaves no deck around the hatches");
  if (breach_m >= 0.8 * depth_m || hole_m >= 0.8 * depth_m)
    throw UsageError("scene.wreck.breach_m and hole_m must be smaller than 0.8 of depth_m");
  if (deckhouse_size_m.x() >= 0.25 * length_m || deckhouse_size_m.y() >= breadth_m)
    throw UsageError("scene.wreck.deckhouse_size_m does not fit on the deck");
}

TriangleMesh GenerateWreck(const WreckOptions& options, std::int64_t seed) {
  options.Validate();
  TriangleMesh mesh = MakeShip(options, seed);
  mesh.Append(MakeFloor(options, mesh, seed));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
