#include "lib/submap/scan_inserter.h"

#include "lib/scan/sonar.h"

namespace vog {
namespace {

octomap::point3d ToOctomap(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

VoxelKey FromOctomap(const octomap::OcTreeKey& key) {
  constexpr std::int32_t kOrigin = 32768;
  return {key[0] - kOrigin, key[1] - kOrigin, key[2] - kOrigin};
}

}  // namespace

ScanInserter::ScanInserter(const SensorModel& model, double voxel_size_m)
    : model_(model), ray_keys_(voxel_size_m) {}

void ScanInserter::Insert(const Scan& scan, const Pose3& X_MB, BrickGrid& grid) {
  const Pose3 X_MS = X_MB * scan.X_BS;
  std::vector<Segment> segments;
  segments.reserve(scan.beams.size());
  for (const Beam& beam : scan.beams) {
    if (beam.status == BeamStatus::kUncertain) continue;
    const bool hit = beam.status == BeamStatus::kReturn;
    const Vec3 direction_S = BeamDirection(beam.bearing_rad);
    const double range_m = hit ? beam.range_m : scan.max_range_m;
    if (range_m < scan.min_range_m) continue;
    segments.push_back({ToOctomap(X_MS * (scan.min_range_m * direction_S)),
                        ToOctomap(X_MS * (range_m * direction_S)), hit});
  }
  Insert(segments, grid);
}

void ScanInserter::Insert(const std::vector<Vec3>& points_M, const Vec3& origin_M,
                          BrickGrid& grid) {
  std::vector<Segment> segments;
  segments.reserve(points_M.size());
  for (const Vec3& point : points_M)
    segments.push_back({ToOctomap(origin_M), ToOctomap(point), true});
  Insert(segments, grid);
}

void ScanInserter::InsertHits(const std::vector<Vec3>& points_M, BrickGrid& grid) {
  std::vector<Segment> segments;
  for (const Vec3& point : points_M) segments.push_back({ToOctomap(point), ToOctomap(point), true});
  Insert(segments, grid);
}

void ScanInserter::Insert(const std::vector<Segment>& segments, BrickGrid& grid) {
  ++scan_;
  octomap::OcTreeKey key;
  for (const Segment& segment : segments) {
    if (segment.hit && ray_keys_.coordToKeyChecked(segment.to, key))
      Update(FromOctomap(key), model_.hit, grid);
  }
  for (const Segment& segment : segments) {
    if (!ray_keys_.coordToKeyChecked(segment.from, key) ||
        !ray_keys_.coordToKeyChecked(segment.to, key))
      continue;
    ray_keys_.computeRayKeys(segment.from, segment.to, keys_);
    for (const octomap::OcTreeKey& passed : keys_) Update(FromOctomap(passed), model_.miss, grid);
  }
}

void ScanInserter::Update(const VoxelKey& key, LogOddsUnits change, BrickGrid& grid) {
  const std::uint16_t brick = grid.BrickOf(key);
  if (brick >= touched_.size()) touched_.resize(brick + 1);
  std::vector<std::uint32_t>& touched = touched_[brick];
  if (touched.empty()) touched.assign(BrickGrid::kBrickVoxels, 0);
  const int index = BrickGrid::IndexInBrick(key);
  if (touched[index] == scan_) return;
  touched[index] = scan_;
  LogOddsUnits& units = grid.ValueAt(brick, index);
  units = static_cast<LogOddsUnits>(model_.Clamp((units == kUnknownUnits ? 0 : units) + change));
}

}  // namespace vog
