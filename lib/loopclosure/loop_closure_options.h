#pragma once

#include "lib/base/config.h"

namespace vog {

/// Table [loop_closure].
struct LoopClosureOptions {
  int min_separation = 1;
  int max_candidates = 12;
  int enough_targets = 60;
  double cell_m = 0.5;
  double min_predicted_overlap = 0.3;
  int region_submaps = 4;
  double min_overlap = 0.3;
  double max_rmse_m = 0.12;
  int min_directions = 2;
  double max_share_in_free_water = 0.2;
  bool both_ways = true;
  int min_neighbours = 3;

  void Visit(OptionsVisitor& v) {
    v("min_separation", min_separation, Between(1, 1e6),
      "submaps this many numbers apart may close a loop");
    v("max_candidates", max_candidates, Between(0, 1000), "registrations tried a submap");
    v("enough_targets", enough_targets, Between(1, 1e6),
      "what so many submaps hold need not be looked for in later ones too");
    v("cell_m", cell_m, Between(0.05, 20), "cells in which overlap is predicted");
    v("min_predicted_overlap", min_predicted_overlap, Between(0, 1),
      "share of a submap's points that must lie in the other's cells to try a registration");
    v("region_submaps", region_submaps, Between(1, 100),
      "earlier submaps that a new one is registered to as to one, at most, where it does not find "
      "its place by each alone; 1: each alone");
    v("min_overlap", min_overlap, Between(0, 1),
      "share of its points that must find a partner in the registration");
    v("max_rmse_m", max_rmse_m, Between(0.001, 5), "largest residual of a registration");
    v("min_directions", min_directions, Between(1, 6),
      "well-conditioned directions that a closure needs: a single one can be checked by nothing");
    v("max_share_in_free_water", max_share_in_free_water, Between(0, 1),
      "share of a submap's points that may lie where the other has seen free water");
    v("both_ways", both_ways,
      "register each closure's submaps the other way round too, which must come to the same");
    v("min_neighbours", min_neighbours, Between(0, 26),
      "occupied voxels with fewer occupied neighbours are taken for noise");
  }
};

}  // namespace vog
