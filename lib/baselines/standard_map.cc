#include "lib/baselines/standard_map.h"

#include "lib/scan/sonar.h"

namespace vog {
namespace {

constexpr std::int32_t kKeyOrigin = 32768;

octomap::point3d ToOctomap(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

float LogOddsOf(const octomap::OcTreeNode* node) {
  return node == nullptr ? kUnknownLogOdds : node->getLogOdds();
}

}  // namespace

StandardMap::StandardMap(double voxel_size_m, const SensorModelOptions& model)
    : OccupancyMap(voxel_size_m, ToLogOdds(SensorModel(model).occupied_from)), tree_(voxel_size_m) {
  // The same rounded log-odds as all maps here.
  const SensorModel units(model);
  const auto probability = [](LogOddsUnits u) { return ProbabilityOfLogOdds(ToLogOdds(u)); };
  tree_.setProbHit(probability(units.hit));
  tree_.setProbMiss(probability(units.miss));
  tree_.setClampingThresMin(probability(units.min));
  tree_.setClampingThresMax(probability(units.max));
  tree_.setOccupancyThres(probability(units.occupied_from));
}

void StandardMap::Insert(const Scan& scan, const Pose3& X_WB) {
  const Pose3 X_WS = X_WB * scan.X_BS;
  octomap::KeySet hits, passes;
  octomap::KeyRay ray;
  for (const Beam& beam : scan.beams) {
    if (beam.status == BeamStatus::kUncertain) continue;
    const bool is_hit = beam.status == BeamStatus::kReturn;
    const double range_m = is_hit ? beam.range_m : scan.max_range_m;
    if (range_m < scan.min_range_m) continue;
    const Vec3 direction_S = BeamDirection(beam.bearing_rad);
    const octomap::point3d from = ToOctomap(X_WS * (scan.min_range_m * direction_S));
    const octomap::point3d to = ToOctomap(X_WS * (range_m * direction_S));
    octomap::OcTreeKey end;
    if (is_hit && tree_.coordToKeyChecked(to, end)) hits.insert(end);
    if (tree_.computeRayKeys(from, to, ray)) passes.insert(ray.begin(), ray.end());
  }
  for (const octomap::OcTreeKey& key : passes) {
    if (!hits.count(key)) tree_.updateNode(key, false);
  }
  for (const octomap::OcTreeKey& key : hits) tree_.updateNode(key, true);
  ++revision_;
}

float StandardMap::LogOddsOfVoxel(const VoxelKey& voxel) const {
  const auto is_inside = [](std::int32_t i) { return i >= -kKeyOrigin && i < kKeyOrigin; };
  if (!is_inside(voxel.x) || !is_inside(voxel.y) || !is_inside(voxel.z)) return kUnknownLogOdds;
  const auto index = [](std::int32_t i) { return static_cast<octomap::key_type>(i + kKeyOrigin); };
  return vog::LogOddsOf(
      tree_.search(octomap::OcTreeKey(index(voxel.x), index(voxel.y), index(voxel.z))));
}

void StandardMap::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  for (std::size_t i = 0; i < points_W.size(); ++i)
    log_odds[i] = LogOddsOfVoxel(grid().KeyOf(points_W[i]));
}

void StandardMap::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  ReadVoxels(voxels, log_odds, [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

void StandardMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  ReadBox(box, log_odds, [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

void StandardMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                          std::vector<RayVoxel>& ray) const {
  WalkRay(origin_W, direction_W, range_m, ray,
          [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

}  // namespace vog
