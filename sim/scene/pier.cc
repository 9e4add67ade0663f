#include "sim/scene/pier.h"

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
constexpr int kPilePoints = 20;
constexpr int kBracePoints = 10;

struct Pile {
  Vec3 foot_W, head_W;
  double radius_m;

  /// On the axis, at a share of the height.
  Vec3 At(double share) const { return foot_W + share * (head_W - foot_W); }
};

/// Piles by row and bent.
using Piles = std::vector<std::vector<Pile>>;

double FloorLevel(const PierOptions& options) { return -0.5 * options.height_m; }

/// A level vector of at most `length_m`, in any direction.
Vec3 LevelUpTo(double length_m, Random& random) {
  const double heading_rad = random.Uniform(0, 2 * kPi);
  return random.Uniform(0, length_m) * Vec3(std::cos(heading_rad), std::sin(heading_rad), 0);
}

Pile MakePile(const PierOptions& options, const Vec3& middle_W, Random random) {
  const Vec3 place_W = middle_W + LevelUpTo(options.offset_m, random);
  const Vec3 lean_m =
      LevelUpTo(0.5 * options.height_m * std::tan(options.lean_deg * kDegree_rad), random);
  const Vec3 up_m(0, 0, 0.5 * options.height_m);
  const double spread = random.Uniform(-options.diameter_spread, options.diameter_spread);
  return {place_W - lean_m - up_m, place_W + lean_m + up_m,
          0.5 * options.pile_diameter_m * (1 + spread)};
}

Piles PlacePiles(const PierOptions& options, std::int64_t seed) {
  Piles piles(options.rows);
  for (int row = 0; row < options.rows; ++row)
    for (int bent = 0; bent < options.bents; ++bent) {
      const Vec3 middle_W((bent - 0.5 * (options.bents - 1)) * options.bent_spacing_m,
                          (row - 0.5 * (options.rows - 1)) * options.row_spacing_m, 0);
      piles[row].push_back(MakePile(
          options, middle_W,
          Random(static_cast<std::uint64_t>(seed), "scene pile", row * options.bents + bent)));
    }
  return piles;
}

/// The piles themselves, down into the floor.
TriangleMesh MakePile(const PierOptions& options, const Pile& pile) {
  const double sunk_m = options.floor ? options.floor_relief_m + 0.5 * pile.radius_m : 0;
  return Cylinder(pile.At(-sunk_m / options.height_m), pile.head_W, pile.radius_m, kPilePoints,
                  options.max_edge_m);
}

/// Two bars from the foot of one pile to the head of the other.
TriangleMesh MakeBrace(const PierOptions& options, const Pile& a, const Pile& b) {
  constexpr double kLow = 0.15, kHigh = 0.88;
  const double radius_m = 0.5 * options.brace_diameter_m;
  TriangleMesh brace =
      Cylinder(a.At(kLow), b.At(kHigh), radius_m, kBracePoints, options.max_edge_m);
  brace.Append(Cylinder(b.At(kLow), a.At(kHigh), radius_m, kBracePoints, options.max_edge_m));
  return brace;
}

TriangleMesh MakeBraces(const PierOptions& options, const Piles& piles) {
  TriangleMesh braces;
  for (int row = 0; row < options.rows; ++row)
    for (int bent = 0; bent < options.bents; ++bent) {
      const Pile& pile = piles[row][bent];
      if (options.bent_braces && row > 0)
        braces.Append(MakeBrace(options, piles[row - 1][bent], pile));
      if (options.bays_per_brace > 0 && bent > 0 && bent % options.bays_per_brace == 0)
        braces.Append(MakeBrace(options, piles[row][bent - 1], pile));
    }
  return braces;
}

/// A square beam across the heads of a bent, which it takes in by half of its height.
TriangleMesh MakeBeam(const PierOptions& options, const Pile& first, const Pile& last) {
  const Vec3 along_m = last.head_W - first.head_W;
  const double length_m = along_m.norm() + 2 * options.pile_diameter_m;
  const double yaw_rad = options.rows > 1 ? std::atan2(along_m.y(), along_m.x()) : 0.5 * kPi;
  return Box(MakePose(0.5 * (first.head_W + last.head_W), {0, 0, yaw_rad}),
             {length_m, options.beam_size_m, options.beam_size_m});
}

/// Lies on the beams, and a bit in them.
TriangleMesh MakeDeck(const PierOptions& options) {
  constexpr double kSunk_m = 0.02;
  const double over_m = 2 * (options.pile_diameter_m + options.offset_m);
  const double z =
      0.5 * options.height_m + 0.5 * options.beam_size_m - kSunk_m + 0.5 * options.deck_thickness_m;
  return Box(MakePose({0, 0, z}),
             {(options.bents - 1) * options.bent_spacing_m + over_m,
              (options.rows - 1) * options.row_spacing_m + over_m, options.deck_thickness_m});
}

TriangleMesh MakeTop(const PierOptions& options, const Piles& piles) {
  TriangleMesh top;
  if (options.top == PierTop::kNone) return top;
  for (int bent = 0; bent < options.bents; ++bent)
    top.Append(MakeBeam(options, piles.front()[bent], piles.back()[bent]));
  if (options.top == PierTop::kDeck) top.Append(MakeDeck(options));
  return top;
}

/// The floor's waves are as long as the pier's bays are wide, twice.
TriangleMesh MakeFloor(const PierOptions& options, const TriangleMesh& pier_W, std::int64_t seed) {
  const Seabed bed(FloorLevel(options), options.floor_relief_m,
                   2 * std::max(options.bent_spacing_m, options.row_spacing_m), seed);
  return bed.Slab(AreaAround(pier_W, options.floor_margin_m), options.max_edge_m);
}

}  // namespace

void PierOptions::Validate() const {
  const double lean_m = height_m * std::tan(lean_deg * kDegree_rad);
  const double reach_m = pile_diameter_m * (1 + diameter_spread) + 2 * offset_m + lean_m;
  if (rows > 1 && row_spacing_m <= reach_m)
    throw UsageError("scene.pier.row_spacing_m lets piles touch each other");
  if (bents > 1 && bent_spacing_m <= reach_m)
    throw UsageError("scene.pier.bent_spacing_m lets piles touch each other");
  if (brace_diameter_m >= pile_diameter_m * (1 - diameter_spread))
    throw UsageError("scene.pier.brace_diameter_m must be smaller than the piles' diameter");
}

TriangleMesh GeneratePier(const PierOptions& options, std::int64_t seed) {
  options.Validate();
  const Piles piles = PlacePiles(options, seed);
  TriangleMesh mesh;
  for (const auto& row : piles)
    for (const Pile& pile : row) mesh.Append(MakePile(options, pile));
  mesh.Append(MakeBraces(options, piles));
  mesh.Append(MakeTop(options, piles));
  if (options.floor) mesh.Append(MakeFloor(options, mesh, seed));
  return Refine(mesh, options.max_edge_m);
}

}  // namespace vog
