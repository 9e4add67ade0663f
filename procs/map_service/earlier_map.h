#pragma once

#include "lib/planner/mission_options.h"
#include "lib/submap/submap_builder.h"
#include "lib/vogmap/map_folder.h"

namespace vog {

/// The map of earlier flights that a mission of these settings may go on from. @throws UsageError
/// for a folder without a map, a map that is damaged, has gaps or parts that no edge joins, one of
/// other voxels or another sensor model, and one that has used the mission's budget already.
StoredMap LoadEarlierMap(const std::filesystem::path& folder, const MissionOptions& mission,
                         const SubmapOptions& submap, const SensorModelOptions& sensor_model);

/// Where the vehicle was when the mission of a map ended: what the map says or, where it says
/// nothing, its last scan.
PlaceInMap EndOf(const StoredMap& map);

/// Where a flight on a map begins, and how well that is known: as well as the place itself is known
/// in the map, and the vehicle is put in there. @throws UsageError when the graph does not tell.
PlaceInMap PutInPlaceOf(const StoredMap& map, const PutInOptions& options);

}  // namespace vog
