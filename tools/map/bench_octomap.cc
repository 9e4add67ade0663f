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

/// A scan's end points, in both forms.
struct Cloud {
  std::vector<Vec3> points_M;
  Vec3 origin_M;
  octomap::Pointcloud octomap_points_M;
};

Cloud CloudOf(const Scan& scan, const Pose3& X_MB) {
  const Pose3 X_MS = X_MB * scan.X_BS;
  Cloud cloud{{}, X_MS.translation(), {}};
  for (const Beam& beam : scan.beams) {
    cloud.points_M.push_back(X_MS * (beam.range_m * BeamDirection(beam.bearing_rad)));
    cloud.octomap_points_M.push_back(ToOctomap(cloud.points_M.back()));
  }
  return cloud;
}

/// The scans of one submap, for both.
struct Recording {
  std::vector<Cloud> clouds;
  std::size_t beams = 0;
};

Recording Record(const BenchScene& scene, SubmapId id) {
  Recording recording;
  const std::vector<PosedScan> scans = scene.ScansOf(id);
  for (const PosedScan& posed : scans) {
    const PosedScan echoes = EchoesOf(posed);
    recording.clouds.push_back(CloudOf(echoes.scan, Ominus(scans.front().X_WB, echoes.X_WB)));
    recording.beams += echoes.scan.beams.size();
  }
  return recording;
}

BrickGrid Insert(const Recording& recording, double voxel_size_m, const SensorModel& model) {
  BrickGrid grid(voxel_size_m);
  ScanInserter inserter(model, voxel_size_m);
  for (const Cloud& cloud : recording.clouds) inserter.Insert(cloud.points_M, cloud.origin_M, grid);
  return grid;
}

std::unique_ptr<octomap::OcTree> InsertInOctomap(const Recording& recording, double voxel_size_m,
                                                 const SensorModel& model) {
  auto tree = std::make_unique<RoundedOcTree>(voxel_size_m, model);
  for (const Cloud& cloud : recording.clouds)
    tree->insertPointCloud(cloud.octomap_points_M, ToOctomap(cloud.origin_M));
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
