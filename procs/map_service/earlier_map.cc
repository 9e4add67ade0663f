#include "procs/map_service/earlier_map.h"

#include "lib/base/files.h"
#include "lib/posegraph/g2o.h"
#include "lib/scan/sonar.h"

namespace vog {
namespace {

/// Covariance of (x, y, yaw) of the motion from the last submap to the first, by the map's graph.
Mat3 CovarianceToFirst(const StoredMap& map) {
  const PoseGraph graph = ToPoseGraph(ParseG2o(map.graph_g2o, "graph.g2o").graph, {},
                                      RotationInformation::kRadians, Objective::kGeodesic);
  const auto covariances =
      graph.RelativeCovariances({{map.submaps.back()->id(), map.submaps.front()->id()}});
  if (covariances.empty())
    throw UsageError(
        "the map's graph does not tell how well its places are known; use "
        "put_in.place = \"end\"");
  return PlanarOf(covariances.front());
}

/// A place in W as one in the map, as well known as W is: by the first submap.
PlaceInMap PlaceAt(const StoredMap& map, const Pose3& X_WE) {
  const Pose3& X_WM = map.X_WM.at(map.submaps.back()->id());
  const Pose3& X_WF = map.X_WM.at(map.submaps.front()->id());
  return {EndOf(map).time, Ominus(X_WM, X_WE),
          ComposePlanarCovariance(CovarianceToFirst(map), Ominus(X_WF, X_WE), Mat3::Zero())};
}

PlaceInMap PlaceOf(const StoredMap& map, const PutInOptions& options) {
  switch (options.place) {
    case PutInPlace::kStart:
      return PlaceAt(map, map.X_WM.at(map.submaps.front()->id()));
    case PutInPlace::kPlace:
      return PlaceAt(map, MakePose(options.position_m, {0, 0, ToRadians(options.yaw_deg)}));
    case PutInPlace::kEnd:
      break;
  }
  return EndOf(map);
}

}  // namespace

StoredMap LoadEarlierMap(const std::filesystem::path& folder, const MissionOptions& mission,
                         const SubmapOptions& submap, const SensorModelOptions& sensor_model) {
  LoadedMap loaded = LoadMapFolder(folder);
  const auto refuse = [&](const std::string& reason) {
    throw UsageError(folder.string() + ": cannot be gone on from: " + reason);
  };
  StoredMap& map = loaded.map;
  if (!loaded.faults.empty()) refuse(loaded.faults.front());
  if (map.submaps.empty()) refuse("it has no submaps");
  if (map.submaps.front()->id() != 0 ||
      map.submaps.back()->id() + 1 != static_cast<SubmapId>(map.submaps.size()))
    refuse("submaps are missing");
  if (map.voxel_size_m != submap.voxel_size_m)
    refuse("its voxels are of " + ToText(map.voxel_size_m) + " m, submap.voxel_size_m is " +
           ToText(submap.voxel_size_m));
  if (map.sensor_model != sensor_model) refuse("it was made with another [sensor_model]");
  if (ConnectedParts(ParseG2o(map.graph_g2o, "graph.g2o").graph).size() != 1)
    refuse("its graph has parts that no edge joins");
  if (static_cast<int>(map.submaps.size()) >= mission.max_submaps)
    refuse("it has " + std::to_string(map.submaps.size()) +
           " submaps, all that mission.max_submaps = " + std::to_string(mission.max_submaps) +
           " allows, earlier flights included");
  return std::move(map);
}

PlaceInMap EndOf(const StoredMap& map) {
  const Submap& last = *map.submaps.back();
  return map.end.value_or(PlaceInMap{last.last_scan, last.X_ML, last.drift});
}

PlaceInMap PutInPlaceOf(const StoredMap& map, const PutInOptions& options) {
  PlaceInMap place = PlaceOf(map, options);
  const double sigma_yaw_rad = ToRadians(options.sigma_yaw_deg);
  place.covariance += Vec3(options.sigma_m * options.sigma_m, options.sigma_m * options.sigma_m,
                           sigma_yaw_rad * sigma_yaw_rad)
                          .asDiagonal();
  return place;
}

}  // namespace vog
