#include "lib/submap/scan_inserter.h"

#include <optional>

#include "lib/scan/sonar.h"

namespace vog {

ScanInserter::ScanInserter(const SensorModel& model, double voxel_size_m, RayWalker::Form form)
    : model_(model), walker_(voxel_size_m, form) {}

void ScanInserter::Insert(const Scan& scan, const Pose3& X_MB, BrickGrid& grid) {
  const Pose3 X_MS = X_MB * scan.X_BS;
  Begin();
  for (const Beam& beam : scan.beams) {
    if (beam.status == BeamStatus::kUncertain) continue;
    const bool hit = beam.status == BeamStatus::kReturn;
    const Vec3 direction_S = BeamDirection(beam.bearing_rad);
    const double range_m = hit ? beam.range_m : scan.max_range_m;
    if (range_m < scan.min_range_m) continue;
    rays_.push_back({(X_MS * (scan.min_range_m * direction_S)).cast<float>(),
                     (X_MS * (range_m * direction_S)).cast<float>()});
    if (hit) hits_.push_back(rays_.back().to);
  }
  Insert(grid);
}

void ScanInserter::Insert(const std::vector<Vec3>& points_M, const Vec3& origin_M,
                          BrickGrid& grid) {
  Begin();
  for (const Vec3& point : points_M) {
    rays_.push_back({origin_M.cast<float>(), point.cast<float>()});
    hits_.push_back(rays_.back().to);
  }
  Insert(grid);
}

void ScanInserter::InsertHits(const std::vector<Vec3>& points_M, BrickGrid& grid) {
  Begin();
  for (const Vec3& point : points_M) hits_.push_back(point.cast<float>());
  Insert(grid);
}

void ScanInserter::Begin() {
  rays_.clear();
  hits_.clear();
  ++scan_;
}

void ScanInserter::Insert(BrickGrid& grid) {
  for (const Eigen::Vector3f& hit : hits_)
    if (const std::optional<VoxelKey> key = walker_.KeyOf(hit)) Update(*key, model_.hit, grid);
  walker_.Walk(rays_, [&](const VoxelKey& passed) { Update(passed, model_.miss, grid); });
}

void ScanInserter::Update(const VoxelKey& key, LogOddsUnits change, BrickGrid& grid) {
  const std::uint16_t brick = grid.BrickOf(key);
  const int index = BrickGrid::IndexInBrick(key);
  if (grid.bricks() * BrickGrid::kBrickVoxels > touched_.size())
    touched_.resize(2 * grid.bricks() * BrickGrid::kBrickVoxels);
  std::uint32_t& touched = touched_[brick * BrickGrid::kBrickVoxels + index];
  if (touched == scan_) return;
  touched = scan_;
  LogOddsUnits& units = grid.ValueAt(brick, index);
  units = static_cast<LogOddsUnits>(model_.Clamp((units == kUnknownUnits ? 0 : units) + change));
}

}  // namespace vog
