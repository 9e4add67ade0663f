#include "tools/map/bench_octomap.h"

#include <octomap/OcTree.h>

#include <sstream>
#include <string_view>

#include "lib/submap/octree_file.h"
#include "lib/submap/scan_inserter.h"
#include "tools/map/bench_clock.h"

namespace vog {
namespace {

constexpr int kKeyOrigin = 32768;

octomap::point3d ToOctomap(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// OctoMap itself, with our rounded log-odds to the last bit.
class RoundedOcTree : public octomap::OcTree {
 public:
  RoundedOcTree(double voxel_size_m, const SensorModel& model) : OcTree(voxel_size_m) {
    prob_hit_log = ToLogOdds(model.hit);
    prob_miss_log = ToLogOdds(model.miss);
    clamping_thres_min = ToLogOdds(model.min);
    clamping_thres_max = ToLogOdds(model.max);
  }
};

/// A scan of echoes alone, from the sonar on: what OctoMap's point clouds can say.
PosedScan EchoesOf(PosedScan posed) {
  posed.scan.min_range_m = 0;
  std::erase_if(posed.scan.beams,
                [](const Beam& beam) { return beam.status != BeamStatus::kReturn; });
  return posed;
}

struct OctomapScan {
  octomap::Pointcloud points_M;
  octomap::point3d origin_M;
};

OctomapScan ToOctomap(const Scan& scan, const Pose3& X_MB) {
  const Pose3 X_MS = X_MB * scan.X_BS;
  OctomapScan cloud{{}, ToOctomap(X_MS.translation())};
  for (const Beam& beam : scan.beams)
    cloud.points_M.push_back(ToOctomap(X_MS * (beam.range_m * BeamDirection(beam.bearing_rad))));
  return cloud;
}

/// The scans of one submap, for both.
struct Recording {
  std::vector<PosedScan> scans;
  std::vector<Pose3> X_MB;
  std::vector<OctomapScan> clouds;
  std::size_t beams = 0;
};

Recording Record(const BenchScene& scene, SubmapId id) {
  Recording recording;
  for (const PosedScan& posed : scene.ScansOf(id)) {
    recording.scans.push_back(EchoesOf(posed));
    const Scan& echoes = recording.scans.back().scan;
    recording.X_MB.push_back(Ominus(recording.scans.front().X_WB, posed.X_WB));
    recording.clouds.push_back(ToOctomap(echoes, recording.X_MB.back()));
    recording.beams += echoes.beams.size();
  }
  return recording;
}

BrickGrid Insert(const Recording& recording, double voxel_size_m, const SensorModel& model) {
  BrickGrid grid(voxel_size_m);
  ScanInserter inserter(model, voxel_size_m);
  for (std::size_t i = 0; i < recording.scans.size(); ++i)
    inserter.Insert(recording.scans[i].scan, recording.X_MB[i], grid);
  return grid;
}

std::unique_ptr<octomap::OcTree> InsertInOctomap(const Recording& recording, double voxel_size_m,
                                                 const SensorModel& model) {
  auto tree = std::make_unique<RoundedOcTree>(voxel_size_m, model);
  for (const OctomapScan& scan : recording.clouds)
    tree->insertPointCloud(scan.points_M, scan.origin_M);
  return tree;
}

std::int64_t CountDifferences(const BrickGrid& grid, octomap::OcTree& tree) {
  tree.expand();
  std::int64_t known = 0, same = 0, leaves = 0;
  grid.ForEach([&](const VoxelKey&, LogOddsUnits) { ++known; });
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf, ++leaves) {
    const octomap::OcTreeKey key = leaf.getKey();
    const LogOddsUnits units =
        grid.Get({key[0] - kKeyOrigin, key[1] - kKeyOrigin, key[2] - kKeyOrigin});
    same += units != kUnknownUnits && ToLogOdds(units) == leaf->getLogOdds();
  }
  return known + leaves - 2 * same;
}

}  // namespace

struct OctomapSubmap::Tree {
  octomap::OcTree octree;
};

OctomapSubmap::OctomapSubmap(const BrickGrid& grid) {
  // OctoMap's reader of whole files tells its progress on standard error.
  constexpr std::string_view kHeaderEnd = "\ndata\n";
  const std::string file = ToOctreeBytes(grid);
  std::istringstream nodes(file.substr(file.find(kHeaderEnd) + kHeaderEnd.size()));
  auto tree = std::make_unique<Tree>(Tree{octomap::OcTree(grid.grid().voxel_size_m())});
  tree->octree.readData(nodes);
  tree_ = std::move(tree);
}

OctomapSubmap::~OctomapSubmap() = default;

std::size_t OctomapSubmap::memory_bytes() const { return tree_->octree.memoryUsage(); }

std::size_t OctomapSubmap::CountKnown(const std::vector<Vec3>& points_M) const {
  std::size_t known = 0;
  for (const Vec3& p : points_M)
    known += tree_->octree.search(p.x(), p.y(), p.z()) != nullptr ? 1 : 0;
  return known;
}

InsertionFigures MeasureInsertion(const BenchScene& scene, int submaps, int repeats) {
  const SensorModel model{SensorModelOptions{}};
  std::vector<Recording> recordings;
  InsertionFigures figures;
  double beams = 0;
  for (SubmapId id = 0; id < submaps; ++id) {
    const Recording& recording = recordings.emplace_back(Record(scene, id));
    beams += static_cast<double>(recording.beams);
    const BrickGrid grid = Insert(recording, scene.voxel_size_m(), model);
    const auto tree = InsertInOctomap(recording, scene.voxel_size_m(), model);
    figures.differences += CountDifferences(grid, *tree);
  }
  figures.mbeams_s = beams / 1e6 / MedianSeconds(repeats, [&] {
                       for (const Recording& r : recordings) Insert(r, scene.voxel_size_m(), model);
                     });
  figures.octomap_mbeams_s = beams / 1e6 / MedianSeconds(repeats, [&] {
                               for (const Recording& r : recordings)
                                 InsertInOctomap(r, scene.voxel_size_m(), model);
                             });
  return figures;
}

}  // namespace vog
