#include "tools/map/bench_workload.h"

#include <algorithm>

namespace vog {
namespace {

template <class T>
void Shuffle(std::vector<T>& values, Random& random) {
  for (int i = static_cast<int>(values.size()) - 1; i > 0; --i)
    std::swap(values[i], values[random.Index(i + 1)]);
}

Vec3 RandomDirection(Random& random) { return random.GaussianVector(Vec3::Ones()).normalized(); }

std::vector<VoxelKey> KnownVoxels(const BenchScene& scene, std::span<const BenchSubmap> submaps) {
  constexpr int kVoxels = 100'000, kSources = 100;
  const VoxelGrid grid(scene.voxel_size_m());
  Random random(scene.seed(), "bench known voxels");
  std::vector<VoxelKey> voxels;
  for (int source = 0; source < kSources; ++source) {
    const auto& [submap, X_WM] = submaps[random.Index(static_cast<int>(submaps.size()))];
    for (const Vec3& p_M : KnownPlaces_M(submap->grid, kVoxels / kSources, random))
      voxels.push_back(grid.KeyOf(X_WM * p_M));
  }
  Shuffle(voxels, random);
  return voxels;
}

std::vector<BenchRay> RandomRays(const BenchScene& scene) {
  constexpr int kRays = 2000;
  Random random(scene.seed(), "bench rays");
  std::vector<BenchRay> rays;
  while (rays.size() < kRays)
    rays.push_back({scene.FreePose(random).position_W_m, RandomDirection(random)});
  return rays;
}

/// The fan's beams, at one tilt.
BenchView ViewOf(const SonarOptions& sonar, const Pose3& X_WB, double tilt_rad) {
  const double fan_rad = ToRadians(sonar.fov_deg);
  const Pose3 X_WS = X_WB * SonarPose(sonar, tilt_rad);
  BenchView view{X_WS.translation(), {}};
  for (int b = 0; b < kViewRays; ++b)
    view.directions_W.push_back(X_WS.linear() *
                                BeamDirection(fan_rad * (1.0 * b / (kViewRays - 1) - 0.5)));
  return view;
}

/// The views of a tree: each at most an edge away from one before, which is drawn anew.
std::vector<BenchView> StepViews(const BenchScene& scene) {
  constexpr double kEdge_m = 1;  // Table III.
  Random random(scene.seed(), "bench views");
  std::vector<Waypoint> nodes = {scene.FreePose(random)};
  std::vector<BenchView> views;
  for (int view = 0; view < kStepViews; ++view) {
    const auto parent = static_cast<std::size_t>(random.Index(static_cast<int>(nodes.size())));
    nodes.push_back(scene.FreePoseNear(nodes[parent], kEdge_m, random));
    const double tilt_rad = ToRadians(scene.sonar().tilt_amplitude_deg) * random.Uniform(-1, 1);
    views.push_back(ViewOf(scene.sonar(), nodes.back().X_WB(), tilt_rad));
  }
  return views;
}

std::vector<Waypoint> RandomPoses(const BenchScene& scene) {
  constexpr int kPoses = 200;
  Random random(scene.seed(), "bench collisions");
  std::vector<Waypoint> poses;
  while (poses.size() < kPoses) poses.push_back(scene.AnyPose(random));
  return poses;
}

}  // namespace

BenchWorkload MakeWorkload(const BenchScene& scene, std::span<const BenchSubmap> submaps) {
  return {KnownVoxels(scene, submaps), RandomRays(scene), StepViews(scene), RandomPoses(scene)};
}

std::vector<Vec3> KnownPlaces_M(const BrickGrid& grid, int count, Random& random) {
  std::vector<VoxelKey> known;
  grid.ForEach([&](const VoxelKey& key, LogOddsUnits) { known.push_back(key); });
  std::vector<Vec3> places_M;
  for (int i = 0; i < count; ++i)
    places_M.push_back(grid.grid().CenterOf(known[random.Index(static_cast<int>(known.size()))]));
  return places_M;
}

PosesWM CorrectedPoses(const BenchScene& scene, std::span<const BenchSubmap> submaps, int count,
                       int round) {
  Random random(scene.seed(), "bench corrections", round);
  PosesWM poses;
  for (int i = 0; i < count; ++i) {
    const auto& [submap, X_WM] = submaps[submaps.size() * i / count];
    poses.emplace_back(submap->id(), Nudged(X_WM, random));
  }
  return poses;
}

double OverlapAt(std::span<const BenchSubmap> submaps, const VoxelGrid& grid,
                 std::span<const VoxelKey> voxels) {
  std::size_t knowing = 0;
  for (const auto& [submap, X_WM] : submaps) {
    const Pose3 X_MW = X_WM.inverse();
    for (const VoxelKey& voxel : voxels)
      knowing += submap->grid.Get(grid.KeyOf(X_MW * grid.CenterOf(voxel))) != kUnknownUnits;
  }
  return static_cast<double>(knowing) / static_cast<double>(voxels.size());
}

std::size_t CountUnknown(const OccupancyMap& map, std::span<const BenchView> views) {
  std::size_t count = 0;
  std::vector<VoxelKey> unknown;
  for (const BenchView& view : views) {
    map.SeeUnknown(view.origin_W, view.directions_W, 0, kRayLength_m, nullptr, unknown);
    count += unknown.size();
  }
  return count;
}

}  // namespace vog
