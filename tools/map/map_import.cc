#include "tools/map/map_import.h"

#include <algorithm>
#include <cctype>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/geometry/cloud_file.h"
#include "lib/posegraph/g2o.h"
#include "lib/submap/octree_file.h"
#include "tools/map/scan_graph_file.h"

namespace vog {
namespace {

/// Turns a vector between NED and ENU-like axes, or between FRD and FLU: x stays, y and z change
/// sign.
Pose3 FlipZ() {
  Pose3 X = Pose3::Identity();
  X.linear() = Vec3(1, -1, -1).asDiagonal();
  return X;
}

CloudFile ReadTurned(const std::filesystem::path& file, bool z_down) {
  CloudFile cloud = ReadCloud(file);
  if (!z_down) return cloud;
  cloud.X_WV = FlipZ() * cloud.X_WV * FlipZ();
  for (Vec3& point : cloud.points_V) point = FlipZ() * point;
  return cloud;
}

/// The number in a name such as "12.pcd" or "cloud_0012.pcd"; names without one come last.
long NumberIn(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const auto last = std::find_if(stem.rbegin(), stem.rend(), is_digit);
  const auto first = std::find_if_not(last, stem.rend(), is_digit);
  const std::string digits(first.base(), last.base());
  return digits.empty() || digits.size() > 9 ? std::numeric_limits<long>::max() : std::stol(digits);
}

std::vector<std::filesystem::path> CloudsIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".pcd") files.push_back(entry.path());
  }
  if (files.empty()) throw UsageError(folder.string() + ": no .pcd files here");
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
    return std::pair(NumberIn(a), a.string()) < std::pair(NumberIn(b), b.string());
  });
  return files;
}

Mat6 AssumedCovariance(const ImportOptions& options) {
  constexpr double kSigmaZ_m = 0.05, kSigmaAngle_rad = 0.01;
  Vec6 sigma;
  sigma << options.sigma_xy_m, options.sigma_xy_m, kSigmaZ_m, kSigmaAngle_rad, kSigmaAngle_rad,
      options.sigma_yaw_rad;
  return sigma.cwiseAbs2().asDiagonal();
}

/// Gathers submaps whose bases are given in W.
class MapMaker {
 public:
  explicit MapMaker(const ImportOptions& options) : options_(options) {
    map_.voxel_size_m = options.submap.voxel_size_m;
    map_.sensor_model = options.sensor_model;
    map_.complete = true;
  }

  void Add(BrickGrid grid, const Pose3& X_WM, int scans) {
    const int id = static_cast<int>(map_.submaps.size());
    auto submap = std::make_shared<Submap>(Submap{.base = {},
                                                  .first_scan = Time(std::chrono::seconds(id)),
                                                  .last_scan = Time(std::chrono::seconds(id)),
                                                  .scans = scans,
                                                  .grid = std::move(grid)});
    submap->base.id = id;
    submap->base.odometry.time = submap->first_scan;
    submap->base.odometry.X_OB = X_WM;
    if (id > 0) {
      submap->base.edge = {Ominus(map_.X_WM.at(id - 1), X_WM), AssumedCovariance(options_)};
      graph_.edges.push_back(
          {id - 1, id, submap->base.edge.X_PM, submap->base.edge.covariance.inverse()});
    }
    graph_.vertices[id] = map_.X_WM[id] = X_WM;
    map_.submaps.push_back(std::move(submap));
  }

  StoredMap Finish() {
    if (!graph_.vertices.empty()) graph_.fixed = {graph_.vertices.begin()->first};
    map_.graph_g2o = ToG2oText(graph_);
    return std::move(map_);
  }

 private:
  const ImportOptions& options_;
  StoredMap map_;
  G2oGraph graph_;
};

}  // namespace

StoredMap ImportClouds(const std::filesystem::path& folder, const ImportOptions& options) {
  MapMaker maker(options);
  for (const auto& file : CloudsIn(folder)) {
    const CloudFile cloud = ReadTurned(file, options.z_down);
    BrickGrid grid(options.submap.voxel_size_m);
    ScanInserter inserter(SensorModel(options.sensor_model), options.submap.voxel_size_m);
    if (options.free_space == FreeSpace::kRays) {
      inserter.Insert(cloud.points_V, Vec3::Zero(), grid);
    } else {
      inserter.InsertHits(cloud.points_V, grid);
    }
    maker.Add(std::move(grid), cloud.X_WV, 1);
  }
  return maker.Finish();
}

StoredMap ImportScanGraph(const std::filesystem::path& file, const ImportOptions& options) {
  MapMaker maker(options);
  const std::vector<GraphScan> scans = ReadScanGraph(file);
  const auto per_submap = static_cast<std::size_t>(options.submap.scans_per_submap);
  for (std::size_t first = 0; first < scans.size(); first += per_submap) {
    const std::size_t end = std::min(scans.size(), first + per_submap);
    const Pose3 X_WM = scans[first].X_WS;
    BrickGrid grid(options.submap.voxel_size_m);
    ScanInserter inserter(SensorModel(options.sensor_model), options.submap.voxel_size_m);
    for (std::size_t i = first; i < end; ++i) {
      const Pose3 X_MS = Ominus(X_WM, scans[i].X_WS);
      std::vector<Vec3> points_M;
      for (const Vec3& p_S : scans[i].points_S) points_M.push_back(X_MS * p_S);
      inserter.Insert(points_M, X_MS.translation(), grid);
    }
    maker.Add(std::move(grid), X_WM, static_cast<int>(end - first));
  }
  return maker.Finish();
}

StoredMap ImportOctree(const std::filesystem::path& file, const ImportOptions& options) {
  const std::string bytes = ReadFile(file);
  auto grid = file.extension() == ".bt"
                  ? FromBinaryOctreeBytes(bytes, SensorModel(options.sensor_model))
                  : FromOctreeBytes(bytes);
  if (const auto* fault = std::get_if<std::string>(&grid))
    throw UsageError(file.string() + ": " + *fault);
  ImportOptions own = options;
  own.submap.voxel_size_m = std::get<BrickGrid>(grid).grid().voxel_size_m();
  MapMaker maker(own);
  maker.Add(std::move(std::get<BrickGrid>(grid)), options.z_down ? FlipZ() : Pose3::Identity(), 1);
  return maker.Finish();
}

}  // namespace vog
