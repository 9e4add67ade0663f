#pragma once

#include <memory>

#include "lib/vogmap/map_options.h"
#include "lib/vogmap/submap_map.h"

namespace vog {

/// An empty map of placed submaps that answers by `method`.
std::unique_ptr<SubmapMap> MakeSubmapMap(MapMethod method, double voxel_size_m,
                                         const SensorModel& model);

}  // namespace vog
