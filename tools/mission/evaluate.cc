#include "tools/mission/evaluate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/log.h"
#include "lib/base/parallel.h"
#include "lib/evaluation/cloud_error.h"
#include "lib/evaluation/coverage.h"
#include "lib/geometry/cloud_file.h"
#include "lib/planner/planner_options.h"
#include "lib/submap/submap_builder.h"
#include "lib/vogmap/map_folder.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/scene_options.h"
#include "sim/world/world_options.h"
#include "tools/mission/hull_space.h"
#include "tools/mission/node_errors.h"
#include "tools/mission/run_record.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPointCell_m = 0.05;
constexpr double kSeriesStep_s = 1;
constexpr std::array kCoordinates = {"x", "y", "z", "roll", "pitch", "yaw"};

/// A scan of a submap, at its estimated and its true pose.
struct PlacedScan {
  const RunScan* run;
  Pose3 X_WB_estimate;
};

/// All that the judges below look at.
struct Run {
  RunRecord record;
  StoredMap map;
  TriangleMesh scene_W;
  SonarOptions sonar;
  SubmapOptions submap;
  SensorModelOptions sensor_model;
  PlannerOptions planner;
  VehicleOptions vehicle;
  ExplorationOptions exploration;
  WorldOptions simulation;
  EvaluationOptions options;
  std::size_t submaps_in_map = 0;  ///< Those of earlier runs without truth are not in `map`.
  /// The scans of each submap, in the order of the map's submaps.
  std::vector<std::vector<PlacedScan>> scans_of;

  LogOddsUnits occupied_from() const { return SensorModel(sensor_model).occupied_from; }
};

std::vector<std::vector<PlacedScan>> AssignScans(const RunRecord& record, const StoredMap& map) {
  std::vector<std::vector<PlacedScan>> scans_of(map.submaps.size());
  for (std::size_t s = 0; s < map.submaps.size(); ++s) {
    const Submap& submap = *map.submaps[s];
    const Pose3 X_WO = map.X_WM.at(submap.id()) * submap.base.odometry.X_OB.inverse();
    const auto begin =
        std::lower_bound(record.scans.begin(), record.scans.end(), submap.first_scan,
                         [](const RunScan& scan, Time time) { return scan.scan.time < time; });
    for (auto it = begin; it != record.scans.end() && it->scan.time <= submap.last_scan; ++it)
      scans_of[s].push_back({&*it, X_WO * it->odometry.X_OB});
  }
  return scans_of;
}

/// Leaves out the submaps of earlier runs of which no log is kept.
void LeaveOutUnjudged(const RunRecord& record, StoredMap& map) {
  if (!map.put_in) return;
  std::erase_if(map.submaps, [&](const SubmapPtr& submap) {
    return submap->id() < map.put_in->id && submap->first_scan < record.begins.front();
  });
}

Run ReadAll(const std::filesystem::path& folder, StoredMap map) {
  Run run;
  run.record = ReadFlights(folder);
  run.map = std::move(map);
  run.submaps_in_map = run.map.submaps.size();
  LeaveOutUnjudged(run.record, run.map);
  run.scene_W = LoadMesh(folder / "scene.ply", 1);
  const Config& config = run.record.config;
  run.sonar = config.Read<SonarOptions>("sonar");
  run.submap = config.Read<SubmapOptions>("submap");
  run.sensor_model = config.Read<SensorModelOptions>("sensor_model");
  run.planner = config.Read<PlannerOptions>("planner");
  run.vehicle = config.Read<VehicleOptions>("vehicle");
  run.exploration = config.Read<ExplorationOptions>("exploration");
  run.simulation = config.Read<WorldOptions>("simulation");
  run.options = config.Read<EvaluationOptions>("evaluation");
  run.scans_of = AssignScans(run.record, run.map);
  return run;
}

void AppendMoved(const std::vector<Vec3>& points_M, const Pose3& X_WM, std::vector<Vec3>& cloud_W) {
  for (const Vec3& p_M : points_M) cloud_W.push_back(X_WM * p_M);
}

/// Occupied voxels of all submaps, built and placed with true poses.
std::vector<Vec3> TruthCloud(const Run& run) {
  std::vector<std::vector<Vec3>> parts(run.scans_of.size());
  ParallelFor(run.scans_of.size(), [&](std::size_t s) {
    if (run.scans_of[s].empty()) return;
    BrickGrid grid(run.submap.voxel_size_m);
    ScanInserter inserter(SensorModel(run.sensor_model), run.submap.voxel_size_m);
    const Pose3 X_WM = run.scans_of[s].front().run->X_WB_true;
    for (const PlacedScan& placed : run.scans_of[s])
      inserter.Insert(placed.run->scan, Ominus(X_WM, placed.run->X_WB_true), grid);
    AppendMoved(OccupiedPoints(grid, run.occupied_from(), run.options.min_neighbours), X_WM,
                parts[s]);
  });
  std::vector<Vec3> cloud_W;
  for (const auto& part : parts) cloud_W.insert(cloud_W.end(), part.begin(), part.end());
  return cloud_W;
}

std::vector<Vec3> MapCloud(const Run& run, bool at_odometry) {
  std::vector<Vec3> cloud_W;
  for (const SubmapPtr& submap : run.map.submaps)
    AppendMoved(OccupiedPoints(submap->grid, run.occupied_from(), run.options.min_neighbours),
                at_odometry ? submap->base.odometry.X_OB : run.map.X_WM.at(submap->id()), cloud_W);
  return cloud_W;
}

/// Occupied voxels of the standard map. ScanInserter gives what StandardMap's OctoMap gives, voxel
/// for voxel, some ten times faster.
std::vector<Vec3> StandardCloud(const Run& run) {
  BrickGrid grid(run.submap.voxel_size_m);
  ScanInserter inserter(SensorModel(run.sensor_model), run.submap.voxel_size_m);
  for (const auto& scans : run.scans_of)
    for (const PlacedScan& placed : scans)
      inserter.Insert(placed.run->scan, placed.run->odometry.X_OB, grid);
  return OccupiedPoints(grid, run.occupied_from(), run.options.min_neighbours);
}

double RmseOf(const std::vector<Vec3>& cloud, const std::vector<Vec3>& truth) {
  return cloud.empty() || truth.empty() ? 0 : MeasureCloud(cloud, truth).rmse_m;
}

void JudgeClouds(const Run& run, const std::filesystem::path& folder, Json& metrics) {
  const std::vector<Vec3> truth = TruthCloud(run);
  WriteCloud(folder / "reconstruction_truth.ply", truth);
  const auto judge = [&](const char* name, const std::vector<Vec3>& cloud) {
    WriteCloud(folder / (std::string("reconstruction_") + name + ".ply"), cloud);
    metrics["rmse_m"][name] = RmseOf(cloud, truth);
  };
  judge("vog", MapCloud(run, /*at_odometry=*/false));
  judge("vog_no_lc", MapCloud(run, /*at_odometry=*/true));
  judge("standard", StandardCloud(run));
}

void JudgePoints(const Run& run, Json& metrics) {
  std::vector<Vec3> truth, estimate, odometry;
  for (const auto& scans : run.scans_of)
    for (const PlacedScan& placed : scans)
      for (const Vec3& p_B : EndPoints_B(placed.run->scan)) {
        truth.push_back(placed.run->X_WB_true * p_B);
        estimate.push_back(placed.X_WB_estimate * p_B);
        odometry.push_back(placed.run->odometry.X_OB * p_B);
      }
  const std::vector<Vec3> thin_truth = Downsample(truth, kPointCell_m);
  const auto judge = [&](const char* name, const std::vector<Vec3>& points) {
    metrics["rmse_points_m"][name] = RmseOf(Downsample(points, kPointCell_m), thin_truth);
    if (points.empty()) return;
    const Pose3 X_truth_estimate = AlignPoints(points, truth);
    double sum_m = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      sum_m += (X_truth_estimate * points[i] - truth[i]).norm();
    metrics["point_error_m"][name] = sum_m / static_cast<double>(points.size());
  };
  judge("estimate", estimate);
  judge("odometry", odometry);
}

struct Trajectories {
  Trajectory truth, estimate, odometry;
  Trajectory within_submaps;  ///< Reckoned from where each submap truly began.
};

Trajectories MakeTrajectories(const Run& run) {
  Trajectories all;
  for (const auto& scans : run.scans_of)
    for (const PlacedScan& placed : scans) {
      const Time time = placed.run->scan.time;
      const RunScan& first = *scans.front().run;
      all.truth.push_back({time, placed.run->X_WB_true});
      all.estimate.push_back({time, placed.X_WB_estimate});
      all.odometry.push_back({time, placed.run->odometry.X_OB});
      all.within_submaps.push_back(
          {time, first.X_WB_true * Ominus(first.odometry.X_OB, placed.run->odometry.X_OB)});
    }
  return all;
}

/// Without the ways on deck from one flight to the next.
double FlownLength(const Trajectory& trajectory, const std::vector<Time>& begins) {
  double length_m = 0;
  Trajectory flight;
  auto next = begins.begin();
  for (const TimedPose& pose : trajectory) {
    while (next != begins.end() && *next <= pose.time) {
      length_m += PathLength(flight);
      flight.clear();
      ++next;
    }
    flight.push_back(pose);
  }
  return length_m + PathLength(flight);
}

/// Of a run that went on from others, the submaps of those, and how many of them are judged.
Json EarlierSubmaps(const Run& run) {
  const auto left_out = run.submaps_in_map - run.map.submaps.size();
  const auto all = static_cast<std::size_t>(run.map.put_in->id);
  if (left_out > 0)
    LogLine("the first " + std::to_string(left_out) +
            " submaps are not judged: no log of their run tells the truth");
  return {{"all", all}, {"judged", all - left_out}};
}

double ErrorAt(const Trajectory& trajectory, const Trajectory& truth, std::size_t i) {
  return (trajectory[i].X_WB.translation() - truth[i].X_WB.translation()).norm();
}

Json PositionError(const Trajectory& trajectory, const Trajectory& truth) {
  if (truth.empty()) return {{"mean", 0}, {"end", 0}};
  double sum_m = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum_m += ErrorAt(trajectory, truth, i);
  return {{"mean", sum_m / static_cast<double>(truth.size())},
          {"end", ErrorAt(trajectory, truth, truth.size() - 1)}};
}

std::map<SubmapId, SubmapTruth> TruthOfSubmaps(const Run& run) {
  std::map<SubmapId, SubmapTruth> truth;
  for (std::size_t s = 0; s < run.map.submaps.size(); ++s) {
    const Submap& submap = *run.map.submaps[s];
    const auto& scans = run.scans_of[s];
    if (scans.empty() || scans.front().run->scan.time != submap.first_scan ||
        scans.back().run->scan.time != submap.last_scan)
      continue;
    truth[submap.id()] = {scans.front().run->X_WB_true, scans.back().run->X_WB_true};
  }
  return truth;
}

/// The errors of the submaps' poses, and into `metrics` whether they are as large as SLAM says.
ErrorsOfNodes JudgeCovariances(const Run& run, Json& metrics) {
  const auto options = run.record.config.Read<SlamOptions>("slam");
  ErrorsOfNodes nodes = NodeErrors(run.map, options, TruthOfSubmaps(run));
  const auto judged = JudgeConsistency(nodes.errors);
  metrics["nees_per_dimension"] = judged ? Json(judged->nees_per_dimension) : Json(nullptr);
  metrics["nees_share_below_95"] = judged ? Json(judged->share_below_95) : Json(nullptr);
  return nodes;
}

/// A point a submap, at its first scan.
Json NeesSeries(const StoredMap& map, const ErrorsOfNodes& nodes) {
  const auto nees = NeesPerDimension(nodes.errors);
  Json series = Json::array();
  if (!nees) return series;
  std::size_t i = 0;
  for (const SubmapPtr& submap : map.submaps) {
    if (i == nodes.ids.size()) break;
    if (submap->id() == nodes.ids[i])
      series.push_back({ToSeconds(submap->first_scan), (*nees)[i++]});
  }
  return series;
}

Json TimeToJson(const CoverageCurve& curve, double share) {
  const auto time_s = curve.TimeTo(share);
  return time_s ? Json(*time_s) : Json(nullptr);
}

Json SeriesOf(const CoverageCurve& curve) {
  Json series = Json::array();
  double next_s = 0;
  for (const auto& [time_s, share] : curve.points) {
    if (time_s < next_s) continue;
    series.push_back({time_s, share});
    next_s = time_s + kSeriesStep_s;
  }
  return series;
}

void JudgeCoverage(const Run& run, Json& metrics, Json& series) {
  const HullSpace space(run.scene_W, run.vehicle.hull_size_m);
  const RayCaster& scene = space.scene();
  const TrueWorld world{
      [&](const Vec3& from_W, const Vec3& to_W) { return scene.Occluded(from_W, to_W); },
      [&](const Vec3& p_W) { return space.Fits(p_W); }};
  const Eigen::AlignedBox3d box_W = run.exploration.box_W();
  const Reachability reach(world, box_W, run.simulation.start_position_m, run.options.reach_step_m);

  const auto samples = SampleSurface(run.scene_W, run.options.surface_spacing_m);
  std::vector<char> is_reachable(samples.size());
  ParallelFor(samples.size(), [&](std::size_t i) {
    is_reachable[i] =
        box_W.contains(samples[i].position_W_m) &&
        reach.IsVisible(samples[i].position_W_m, run.sonar.max_range_m, &samples[i].normal_W);
  });
  std::vector<SurfaceSample> reachable;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (is_reachable[i]) reachable.push_back(samples[i]);
  }

  const VoxelGrid grid(run.submap.voxel_size_m);
  const VoxelBox box = VoxelsOf(grid, box_W);
  // Seen on a lattice of every second voxel, and taken for its neighbours too.
  constexpr int kStride = 2;
  const VoxelGrid coarse(kStride * run.submap.voxel_size_m);
  const VoxelBox coarse_box = VoxelsOf(coarse, box_W);
  std::vector<VoxelKey> coarse_voxels;
  ForEachVoxel(coarse_box, [&](const VoxelKey& voxel) { coarse_voxels.push_back(voxel); });
  std::vector<char> coarse_visible(coarse_voxels.size());
  ParallelFor(coarse_voxels.size(), [&](std::size_t i) {
    const Vec3 p_W = coarse.CenterOf(coarse_voxels[i]);
    coarse_visible[i] = !scene.Inside(p_W) && reach.IsVisible(p_W, run.sonar.max_range_m);
  });
  std::vector<bool> visible(box.count());
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    const VoxelKey parent = coarse.KeyOf(grid.CenterOf(voxel));
    visible[box.IndexOf(voxel)] =
        coarse_box.Contains(parent) && coarse_visible[coarse_box.IndexOf(parent)];
  });

  SurfaceCoverage surface(std::move(reachable), run.options.surface_tolerance_m);
  VolumeCoverage volume(grid, box, std::move(visible));
  for (const auto& scans : run.scans_of)
    for (const PlacedScan& placed : scans) {
      surface.AddScan(placed.run->scan, placed.run->X_WB_true);
      volume.AddScan(placed.run->scan, placed.run->X_WB_true);
    }
  metrics["coverage"] = {{"surface", surface.curve().final_share()},
                         {"volume", volume.curve().final_share()}};
  metrics["time_to_s"] = {{"surface_90", TimeToJson(surface.curve(), 0.90)},
                          {"volume_95", TimeToJson(volume.curve(), 0.95)}};
  series["surface"] = SeriesOf(surface.curve());
  series["volume"] = SeriesOf(volume.curve());
}

/// The hull's clearance at each pose, where it may be the least of all; elsewhere a bound that lies
/// above that. From pose to pose it changes by no more than the hull's corners move.
std::vector<double> LeastClearances(const MeshClearance& clearance, const Vec3& hull_size_m,
                                    const Trajectory& truth) {
  const double corner_m = 0.5 * hull_size_m.norm();
  constexpr std::size_t kPiece = 2000;
  std::vector<double> distance_m(truth.size());
  ParallelFor((truth.size() + kPiece - 1) / kPiece, [&](std::size_t piece) {
    double least_m = std::numeric_limits<double>::max(), bound_m = 0;
    for (std::size_t i = piece * kPiece; i < std::min(truth.size(), (piece + 1) * kPiece); ++i) {
      if (i > piece * kPiece) {
        const Vec6 motion = Log(Ominus(truth[i - 1].X_WB, truth[i].X_WB));
        bound_m -= motion.head<3>().norm() + corner_m * motion.tail<3>().norm();
      }
      if (bound_m <= std::max(0.0, least_m)) bound_m = clearance.DistanceAt(truth[i].X_WB);
      distance_m[i] = bound_m;
      least_m = std::min(least_m, bound_m);
    }
  });
  return distance_m;
}

void JudgeCollisions(const Run& run, Json& metrics) {
  const MeshClearance clearance(run.scene_W, run.vehicle.hull_size_m);
  const std::vector<double> distance_m =
      LeastClearances(clearance, run.vehicle.hull_size_m, run.record.truth);
  Json touches_s = Json::array();
  std::size_t closest = 0;
  for (std::size_t i = 0; i < distance_m.size(); ++i) {
    const bool was_touching = i > 0 && distance_m[i - 1] <= 0;
    if (distance_m[i] <= 0 && !was_touching)
      touches_s.push_back(ToSeconds(run.record.truth[i].time));
    if (distance_m[i] < distance_m[closest]) closest = i;
  }
  metrics["collisions"] = touches_s.size();
  metrics["collision_times_s"] = touches_s;
  const bool is_known = !distance_m.empty();
  metrics["min_clearance_m"] = is_known ? Json(distance_m[closest]) : Json();
  metrics["min_clearance_time_s"] =
      is_known ? Json(ToSeconds(run.record.truth[closest].time)) : Json();
}

std::string SceneNameOf(const SceneOptions& scene) {
  if (scene.kind == SceneKind::kMesh) return std::filesystem::path(scene.mesh).stem().string();
  return NameOf(SceneKindNames(), scene.kind);
}

/// A line a submap: its pose and the upper triangles of its two covariances.
std::string PlacesCsv(const std::vector<SubmapPlace>& places) {
  std::ostringstream csv;
  csv.precision(9);
  csv << "submap,x_m,y_m,z_m,qx,qy,qz,qw";
  for (const char* of : {"WM", "MN"})
    for (std::size_t row = 0; row < kCoordinates.size(); ++row)
      for (std::size_t col = row; col < kCoordinates.size(); ++col)
        csv << ",covariance_" << of << '_' << kCoordinates[row] << '_' << kCoordinates[col];
  csv << '\n';
  for (const SubmapPlace& place : places) {
    const Vec3 t = place.X_WM.translation();
    const Eigen::Quaterniond q(place.X_WM.linear());
    csv << place.id;
    for (const double number : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
      csv << ',' << number;
    for (const Mat6* covariance : {&place.covariance_WM, &place.covariance_MN})
      for (int row = 0; row < 6; ++row)
        for (int col = row; col < 6; ++col) csv << ',' << (*covariance)(row, col);
    csv << '\n';
  }
  return csv.str();
}

Json ErrorSeries(const Trajectory& trajectory, const Trajectory& truth) {
  Json series = Json::array();
  double next_s = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double time_s = ToSeconds(truth[i].time);
    if (time_s < next_s) continue;
    series.push_back({time_s, ErrorAt(trajectory, truth, i)});
    next_s = time_s + kSeriesStep_s;
  }
  return series;
}

}  // namespace

nlohmann::ordered_json EvaluateRun(const std::filesystem::path& folder) {
  const Run run = ReadAll(folder, LoadMapFolder(folder / "map").map);
  const Trajectories trajectories = MakeTrajectories(run);
  WriteTum(folder / "truth.tum", trajectories.truth);
  WriteTum(folder / "odometry.tum", trajectories.odometry);
  WriteTum(folder / "estimate.tum", trajectories.estimate);
  WriteFileAtomically(folder / "submap_places.csv", PlacesCsv(run.record.places));

  Json metrics, series;
  metrics["scene"] = SceneNameOf(run.record.config.Read<SceneOptions>("scene"));
  metrics["mode"] = run.record.mode;
  metrics["planner"] = NameOf(PlannerKindNames(), run.planner.kind);
  metrics["seed"] = run.record.seed;
  metrics["end_reason"] = run.record.end_reason;
  metrics["is_home"] = run.record.is_home;
  metrics["unseen_voxels"] = {{"all", run.record.unseen_voxels},
                              {"looked_at_in_vain", run.record.unseen_in_vain}};
  metrics["submaps"] = run.submaps_in_map;
  if (run.map.put_in) metrics["earlier_submaps"] = EarlierSubmaps(run);
  metrics["scans"] = trajectories.truth.size();
  metrics["vehicle_time_s"] = run.record.end_time_s - ToSeconds(run.record.begins.front());
  metrics["path_length_m"] = FlownLength(trajectories.truth, run.record.begins);
  JudgeClouds(run, folder, metrics);
  JudgePoints(run, metrics);
  metrics["position_error_m"] = {
      {"odometry", PositionError(trajectories.odometry, trajectories.truth)},
      {"estimate", PositionError(trajectories.estimate, trajectories.truth)},
      {"within_submaps", PositionError(trajectories.within_submaps, trajectories.truth)}};
  const ErrorsOfNodes nodes = JudgeCovariances(run, metrics);
  JudgeCoverage(run, metrics, series);
  metrics["loop_closures"] = {{"full", run.record.full_closures},
                              {"partial", run.record.partial_closures},
                              {"rejected", run.record.rejected_closures}};
  JudgeCollisions(run, metrics);

  series["odometry_error_m"] = ErrorSeries(trajectories.odometry, trajectories.truth);
  series["estimate_error_m"] = ErrorSeries(trajectories.estimate, trajectories.truth);
  series["nees_per_dimension"] = NeesSeries(run.map, nodes);
  WriteFileAtomically(folder / "timeseries.json", series.dump(1) + "\n");
  WriteFileAtomically(folder / "metrics.json", metrics.dump(2) + "\n");
  return metrics;
}

nlohmann::ordered_json JudgeMap(const std::filesystem::path& folder, const StoredMap& map) {
  const Run run = ReadAll(folder, map);
  const Trajectories trajectories = MakeTrajectories(run);
  Json metrics;
  metrics["rmse_m"] = RmseOf(MapCloud(run, /*at_odometry=*/false), TruthCloud(run));
  metrics["position_error_m"] = PositionError(trajectories.estimate, trajectories.truth);
  JudgeCovariances(run, metrics);
  return metrics;
}

}  // namespace vog
