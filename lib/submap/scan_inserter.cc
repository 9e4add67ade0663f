#include "lib/submap/scan_inserter.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "lib/scan/sonar.h"

namespace vog {

ScanInserter::ScanInserter(const SensorModel& model, double voxel_size_m, WalkForm form)
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
  if (++scan_ == 0) {
    std::fill(touched_.begin(), touched_.end(), 0);
    scan_ = 1;
  }
  constexpr std::int32_t kNowhere = std::numeric_limits<std::int32_t>::max();
  last_ = {kNowhere, kNowhere, kNowhere};
}

void ScanInserter::Insert(BrickGrid& grid) {
  for (const Eigen::Vector3f& hit : hits_)
    if (const std::optional<VoxelKey> key = walker_.KeyOf(hit)) Update(*key, model_.hit, grid);
  walker_.Walk(rays_, [&](const VoxelKey& passed) { Update(passed, model_.miss, grid); });
}

void ScanInserter::Update(const VoxelKey& key, LogOddsUnits change, BrickGrid& grid) {
  const std::int32_t apart = (key.x ^ last_.x) | (key.y ^ last_.y) | (key.z ^ last_.z);
  if (apart & -BrickGrid::kBrickSide) EnterBrick(key, grid);
  const int index = BrickGrid::IndexInBrick(key);
  if (touched_in_brick_[index] == scan_) return;
  const int before = units_[index] == kUnknownUnits ? 0 : units_[index];
  const int after = model_.Clamp(before + change);
  units_[index] = static_cast<LogOddsUnits>(after);
  touched_in_brick_[index] = scan_;
}

void ScanInserter::EnterBrick(const VoxelKey& key, BrickGrid& grid) {
  const std::uint16_t brick = grid.BrickOf(key);
  if (grid.bricks() * BrickGrid::kBrickVoxels > touched_.size())
    touched_.resize(2 * grid.bricks() * BrickGrid::kBrickVoxels);
  units_ = &grid.ValueAt(brick, 0);
  touched_in_brick_ = touched_.data() + brick * BrickGrid::kBrickVoxels;
  last_ = key;
}

}  // namespace vog
