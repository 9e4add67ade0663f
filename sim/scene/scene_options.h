#pragma once

#include <cstdint>
#include <string>

#include "lib/base/config.h"
#include "lib/geometry/pose.h"

namespace vog {

/// What is in the water: a generated structure or a mesh file.
enum class SceneKind { kPropeller, kTank, kPier, kWreck, kSeafloor, kMine, kMesh };

/// The scenes' names in configuration files and metrics.
inline const Names<SceneKind>& SceneKindNames() {
  static const Names<SceneKind> names = {{SceneKind::kPropeller, "propeller"},
                                         {SceneKind::kTank, "tank"},
                                         {SceneKind::kPier, "pier"},
                                         {SceneKind::kWreck, "wreck"},
                                         {SceneKind::kSeafloor, "seafloor"},
                                         {SceneKind::kMine, "mine"},
                                         {SceneKind::kMesh, "mesh"}};
  return names;
}

/// Table [scene].
struct SceneOptions {
  SceneKind kind = SceneKind::kPropeller;
  std::int64_t seed = 1;
  std::string mesh;
  double mesh_scale = 1;

  void Visit(OptionsVisitor& v) {
    v("kind", kind, SceneKindNames(), "a generated structure, or a file");
    v("seed", seed, AtLeast(0),
      "of what is irregular in pier, wreck and seafloor; not the mission's seed, so that missions "
      "with other seeds meet the same structure");
    v("mesh", mesh, "the file (STL, OBJ, PLY or DAE, z up) of kind \"mesh\"");
    v("mesh_scale", mesh_scale, Between(1e-6, 1e6), "metres a unit of the file");
  }
};

/// Table [scene.propeller]: a ship's propeller in front of its rudder, under its stern. The shaft
/// lies on the x axis of W, the bow at +x; the origin is the middle of the piece of ship. Defaults:
/// the proportions of the SS Curtiss in Ho et al. 2018, about 7 x 4 x 6 m.
struct PropellerOptions {
  int blades = 5;
  double radius_m = 2;
  double disc_x_m = 0.3;
  double hub_radius_m = 0.4;
  double hub_length_m = 1.2;
  double pitch_m = 4;
  double skew_deg = 25;
  double blade_chord_m = 1.2;
  double blade_thickness_m = 0.16;
  double shaft_radius_m = 0.26;
  double rudder_chord_m = 1.9;
  double rudder_height_m = 4.7;
  double rudder_thickness_m = 0.32;
  double stern_length_m = 7;
  double stern_breadth_m = 3.8;
  double stern_height_m = 6;
  double counter_height_m = 2.35;
  double skeg_breadth_m = 1.1;
  double max_edge_m = 0.3;

  void Visit(OptionsVisitor& v) {
    v("blades", blades, Between(2, 9), "blades of the propeller");
    v("radius_m", radius_m, Between(0.1, 20), "from the shaft's axis to the blades' tips");
    v("disc_x_m", disc_x_m, Between(-100, 100), "where the propeller's disc stands");
    v("hub_radius_m", hub_radius_m, Between(0.02, 10), "radius of the hub");
    v("hub_length_m", hub_length_m, Between(0.02, 20), "length of the hub without its cap");
    v("pitch_m", pitch_m, Between(0.05, 80), "advance of the blades' helix in one turn");
    v("skew_deg", skew_deg, Between(0, 90), "how far the tips lag behind the roots");
    v("blade_chord_m", blade_chord_m, Between(0.02, 20), "greatest length of a blade's section");
    v("blade_thickness_m", blade_thickness_m, Between(0.002, 2),
      "of a section at the shaft's axis");
    v("shaft_radius_m", shaft_radius_m, Between(0.01, 10), "radius of the shaft");
    v("rudder_chord_m", rudder_chord_m, Between(0.05, 20), "length of the rudder at its top");
    v("rudder_height_m", rudder_height_m, Between(0.05, 40), "span of the rudder");
    v("rudder_thickness_m", rudder_thickness_m, Between(0.01, 5),
      "greatest thickness of the rudder");
    v("stern_length_m", stern_length_m, Between(0.5, 100), "of the piece of ship, along x");
    v("stern_breadth_m", stern_breadth_m, Between(0.2, 50), "of the piece of ship at its top");
    v("stern_height_m", stern_height_m, Between(0.5, 50), "from the keel to the top of the piece");
    v("counter_height_m", counter_height_m, Between(0.1, 50),
      "height of the ship's bottom over the propeller, above the shaft");
    v("skeg_breadth_m", skeg_breadth_m, Between(0.05, 20), "of the keel's fin at its front end");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

/// Table [scene.tank]: a round tank, open at the top, its middle at the origin of W.
/// Defaults: Ho et al. 2018, section VI, 7 x 7 x 3 m.
struct TankOptions {
  double diameter_m = 7;
  double height_m = 3;
  double wall_thickness_m = 0.06;
  int facets = 80;
  Vec3 box_size_m = {1.2, 0.8, 1};
  double box_x_m = 1.3;
  double box_y_m = -1.1;
  double box_yaw_deg = 25;
  double ladder_bearing_deg = 120;
  double ladder_clearance_m = 0.15;
  double ladder_width_m = 0.45;
  int ladder_rungs = 9;
  double ladder_rail_diameter_m = 0.06;
  double ladder_rung_diameter_m = 0.04;
  double max_edge_m = 0.3;

  void Visit(OptionsVisitor& v) {
    v("diameter_m", diameter_m, Between(0.5, 200), "outer diameter of the wall");
    v("height_m", height_m, Between(0.1, 100), "from under the floor to the rim");
    v("wall_thickness_m", wall_thickness_m, Between(0.005, 5), "of the wall and the floor");
    v("facets", facets, Between(8, 1024), "flat pieces around the wall");
    v("box_size_m", box_size_m, Between(0.02, 50), "length, breadth and height of the box");
    v("box_x_m", box_x_m, Between(-100, 100), "where the box stands");
    v("box_y_m", box_y_m, Between(-100, 100), "where the box stands");
    v("box_yaw_deg", box_yaw_deg, Between(-180, 180), "how the box is turned");
    v("ladder_bearing_deg", ladder_bearing_deg, Between(-180, 180),
      "of the ladder from the middle");
    v("ladder_clearance_m", ladder_clearance_m, Between(0, 10), "between the ladder and the wall");
    v("ladder_width_m", ladder_width_m, Between(0.05, 5), "between the middles of the rails");
    v("ladder_rungs", ladder_rungs, Between(1, 200), "rungs, evenly spaced");
    v("ladder_rail_diameter_m", ladder_rail_diameter_m, Between(0.005, 1), "of each rail");
    v("ladder_rung_diameter_m", ladder_rung_diameter_m, Between(0.005, 1), "of each rung");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

/// What is on top of a pier's piles: nothing, a beam across each bent, or a deck on the beams.
enum class PierTop { kNone, kBeams, kDeck };

/// Table [scene.pier]: rows of round piles along the x axis of W. Piles that stand side by side are
/// a bent. The origin is in the middle of all piles, half way up from the sea floor.
struct PierOptions {
  int rows = 2;
  int bents = 5;
  double row_spacing_m = 3.2;
  double bent_spacing_m = 2.8;
  double height_m = 4.5;
  double pile_diameter_m = 0.45;
  double diameter_spread = 0.15;
  double lean_deg = 2.5;
  double offset_m = 0.12;
  bool bent_braces = true;
  int bays_per_brace = 2;
  double brace_diameter_m = 0.18;
  PierTop top = PierTop::kDeck;
  double beam_size_m = 0.4;
  double deck_thickness_m = 0.25;
  bool floor = true;
  double floor_relief_m = 0.12;
  double floor_margin_m = 5;
  double max_edge_m = 0.4;

  void Visit(OptionsVisitor& v) {
    v("rows", rows, Between(1, 50), "rows of piles");
    v("bents", bents, Between(1, 200), "piles in a row");
    v("row_spacing_m", row_spacing_m, Between(0.1, 100), "between rows, along y");
    v("bent_spacing_m", bent_spacing_m, Between(0.1, 100), "between the piles of a row, along x");
    v("height_m", height_m, Between(0.5, 100), "from the floor's mean level to the piles' heads");
    v("pile_diameter_m", pile_diameter_m, Between(0.02, 10), "mean diameter of a pile");
    v("diameter_spread", diameter_spread, Between(0, 0.5), "share by which a pile may differ");
    v("lean_deg", lean_deg, Between(0, 15), "greatest lean of a pile");
    v("offset_m", offset_m, Between(0, 10), "greatest distance of a pile from its regular place");
    v("bent_braces", bent_braces, "a cross-brace between the piles of each bent");
    v("bays_per_brace", bays_per_brace, Between(0, 200),
      "along a row every n-th bay has a cross-brace; 0: none has");
    v("brace_diameter_m", brace_diameter_m, Between(0.01, 5), "of a brace, a round bar");
    v("top", top,
      Names<PierTop>{
          {PierTop::kNone, "none"}, {PierTop::kBeams, "beams"}, {PierTop::kDeck, "deck"}},
      "what is on the piles: a beam across each bent, or a deck on the beams");
    v("beam_size_m", beam_size_m, Between(0.02, 10), "height and breadth of a beam");
    v("deck_thickness_m", deck_thickness_m, Between(0.02, 10), "of the deck");
    v("floor", floor, "whether there is a sea floor");
    v("floor_relief_m", floor_relief_m, Between(0, 10), "its greatest height and depth");
    v("floor_margin_m", floor_margin_m, Between(0, 100), "of it around the piles");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

/// Table [scene.wreck]: the fore part of a ship that broke in two, lying on the sea floor, its bow
/// at +x, hollow and open at the break. The origin of W is amidships at half of the ship's depth.
struct WreckOptions {
  double length_m = 9;
  double breadth_m = 3.8;
  double depth_m = 2.8;
  double plate_thickness_m = 0.08;
  double bulwark_m = 0.3;
  double list_deg = 12;
  double trim_deg = 2;
  double sunk_m = 0.3;
  double ragged_m = 0.7;
  int hatches = 2;
  double hatch_m = 1.8;
  int breaches = 2;
  double breach_m = 2.2;
  int holes = 4;
  double hole_m = 0.6;
  Vec3 deckhouse_size_m = {1.4, 1.8, 1.2};
  double mast_height_m = 2;
  double mast_diameter_m = 0.25;
  double floor_relief_m = 0.15;
  double floor_margin_m = 5;
  double max_edge_m = 0.4;

  void Visit(OptionsVisitor& v) {
    v("length_m", length_m, Between(1, 200), "from the break to the bow");
    v("breadth_m", breadth_m, Between(0.5, 50), "greatest breadth");
    v("depth_m", depth_m, Between(0.5, 50), "from the keel to the gunwale");
    v("plate_thickness_m", plate_thickness_m, Between(0.005, 1), "of shell and deck");
    v("bulwark_m", bulwark_m, Between(0, 10), "height of the gunwale above the deck");
    v("list_deg", list_deg, Between(-90, 90), "turned about its length, starboard down");
    v("trim_deg", trim_deg, Between(-30, 30), "bow down");
    v("sunk_m", sunk_m, Between(0, 20), "depth of the lowest place under the floor's mean level");
    v("ragged_m", ragged_m, Between(0, 20), "how unevenly it is broken off");
    v("hatches", hatches, Between(0, 20), "square openings of the deck");
    v("hatch_m", hatch_m, Between(0.1, 20), "side of a hatch");
    v("breaches", breaches, Between(0, 20), "large holes of the sides, starboard and port in turn");
    v("breach_m", breach_m, Between(0.1, 20), "length of a breach; its height is 0.7 of that");
    v("holes", holes, Between(0, 100), "small round holes of the sides");
    v("hole_m", hole_m, Between(0.05, 20), "diameter of a hole");
    v("deckhouse_size_m", deckhouse_size_m, Between(0.05, 50), "length, breadth and height");
    v("mast_height_m", mast_height_m, Between(0.05, 50), "of the mast's stump above the deck");
    v("mast_diameter_m", mast_diameter_m, Between(0.02, 5), "of the mast");
    v("floor_relief_m", floor_relief_m, Between(0, 10),
      "the sea floor's greatest height and depth");
    v("floor_margin_m", floor_margin_m, Between(0, 100), "of floor around the wreck");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

/// Table [scene.seafloor]: an undulating floor with boulders, boxes and pipes, half sunk. The
/// origin of W is in its middle at its mean level.
struct SeafloorOptions {
  double length_m = 19;
  double breadth_m = 15;
  double relief_m = 0.5;
  double wavelength_m = 7;
  double clutter_length_m = 11;
  double clutter_breadth_m = 7;
  double gap_m = 0.2;
  int boulders = 7;
  double boulder_diameter_m = 1.6;
  int boxes = 3;
  double box_m = 1.4;
  int pipes = 2;
  double pipe_length_m = 3;
  double pipe_diameter_m = 0.6;
  double max_edge_m = 0.4;

  void Visit(OptionsVisitor& v) {
    v("length_m", length_m, Between(1, 500), "of the floor, along x");
    v("breadth_m", breadth_m, Between(1, 500), "of the floor, along y");
    v("relief_m", relief_m, Between(0, 20), "greatest height and depth of the floor");
    v("wavelength_m", wavelength_m, Between(0.5, 500), "of its longest waves");
    v("clutter_length_m", clutter_length_m, Between(1, 500),
      "length of the part in the middle where things lie");
    v("clutter_breadth_m", clutter_breadth_m, Between(1, 500), "breadth of that part");
    v("gap_m", gap_m, Between(0, 50), "between any two things at least");
    v("boulders", boulders, Between(0, 1000), "boulders of various sizes");
    v("boulder_diameter_m", boulder_diameter_m, Between(0.1, 20), "of the largest boulder");
    v("boxes", boxes, Between(0, 1000), "boxes of various sizes");
    v("box_m", box_m, Between(0.1, 20), "longest side of the largest box");
    v("pipes", pipes, Between(0, 1000), "hollow pipes of various sizes");
    v("pipe_length_m", pipe_length_m, Between(0.1, 100), "of the longest pipe");
    v("pipe_diameter_m", pipe_diameter_m, Between(0.05, 10), "of the widest pipe");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

/// Table [scene.mine]: a moored mine, a sphere with horns on a chain above its sinker. The origin
/// of W is the middle of the sphere.
struct MineOptions {
  double diameter_m = 1;
  int horns = 11;
  double horn_length_m = 0.22;
  double horn_diameter_m = 0.1;
  double chain_length_m = 2;
  double chain_lean_deg = 8;
  double chain_bearing_deg = 30;
  double link_length_m = 0.3;
  double link_bar_m = 0.05;
  double sinker_size_m = 0.9;
  double sinker_height_m = 0.5;
  bool floor = false;
  double floor_size_m = 24;
  double max_edge_m = 0.3;

  void Visit(OptionsVisitor& v) {
    v("diameter_m", diameter_m, Between(0.1, 20), "of the sphere");
    v("horns", horns, Between(0, 100), "spread over all of the sphere but its underside");
    v("horn_length_m", horn_length_m, Between(0.01, 5), "length of a horn");
    v("horn_diameter_m", horn_diameter_m, Between(0.01, 2), "diameter of a horn");
    v("chain_length_m", chain_length_m, Between(0.05, 200), "from the sphere to the sinker");
    v("chain_lean_deg", chain_lean_deg, Between(0, 60), "lean of the chain");
    v("chain_bearing_deg", chain_bearing_deg, Between(-180, 180), "of the sinker from the sphere");
    v("link_length_m", link_length_m, Between(0.02, 5), "length of a link");
    v("link_bar_m", link_bar_m, Between(0.005, 1), "diameter of a link's bar");
    v("sinker_size_m", sinker_size_m, Between(0.05, 20), "side of the sinker's foot");
    v("sinker_height_m", sinker_height_m, Between(0.05, 20), "height of the sinker");
    v("floor", floor, "whether there is a flat sea floor under the sinker");
    v("floor_size_m", floor_size_m, Between(1, 500), "side of the floor");
    v("max_edge_m", max_edge_m, Between(0.05, 10), "longest edge of a triangle");
  }

  /// @throws UsageError if the parts do not fit together.
  void Validate() const;
};

}  // namespace vog
