#pragma once

#include <string>

#include "lib/base/config.h"

namespace vog {

/// How the answers of placed submaps are found.
enum class MapMethod {
  kCached,            ///< VogMap: eq. 5, sums at voxel centres remembered.
  kDirect,            ///< DirectMap: eq. 5, nothing remembered.
  kAlgorithm1,        ///< Algorithm1Map: an octree a submap, clamped after each addition.
  kIncrementalMerge,  ///< IncrementalMergeMap: one global grid, made anew when submaps move.
};

/// The names of a method in configuration files and on the command line.
inline const Names<MapMethod>& MapMethodNames() {
  static const Names<MapMethod> names = {{MapMethod::kCached, "cached"},
                                         {MapMethod::kDirect, "direct"},
                                         {MapMethod::kAlgorithm1, "algorithm1"},
                                         {MapMethod::kIncrementalMerge, "incremental_merge"}};
  return names;
}

/// Table [map].
struct MapOptions {
  std::string directory = "map";
  std::string resume;
  MapMethod method = MapMethod::kCached;

  void Visit(OptionsVisitor& v) {
    v("directory", directory, "where the map is kept; a map of the same run there is gone on with");
    v("resume", resume,
      "folder of a map that the mission goes on from, which stays as it is; empty: a new map");
    v("method", method, MapMethodNames(),
      "how the planner's map of submaps answers; all but cached are baselines");
  }
};

}  // namespace vog
