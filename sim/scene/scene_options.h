#pragma once

#include <string>

#include "lib/base/config.h"
#include "lib/geometry/pose.h"

namespace vog {

/// What stands in the water: one of the two generated structures or a mesh file.
enum class SceneKind { kPropeller, kTank, kMesh };

/// Table [scene].
struct SceneOptions {
  SceneKind kind = SceneKind::kPropeller;
  std::string mesh;
  double mesh_scale = 1;

  void Visit(OptionsVisitor& v) {
    v("kind", kind,
      Names<SceneKind>{{SceneKind::kPropeller, "propeller"},
                       {SceneKind::kTank, "tank"},
                       {SceneKind::kMesh, "mesh"}},
      "a ship's propeller with rudder and stern, a round tank with a box and a ladder, or a file");
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

}  // namespace vog
