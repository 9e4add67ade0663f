#include "lib/vogmap/vog_map.h"

#include <array>
#include <bitset>
#include <cmath>
#include <limits>
#include <numbers>

namespace vog {
namespace {

constexpr int kBlockBits = 3;
constexpr int kBlockSide = 1 << kBlockBits;

VoxelKey BlockKeyOf(const VoxelKey& voxel) {
  return {voxel.x >> kBlockBits, voxel.y >> kBlockBits, voxel.z >> kBlockBits};
}

int IndexInBlock(const VoxelKey& voxel) {
  constexpr int kMask = kBlockSide - 1;
  return (voxel.z & kMask) << (2 * kBlockBits) | (voxel.y & kMask) << kBlockBits |
         (voxel.x & kMask);
}

/// No submap has observed the place.
constexpr std::int32_t kUnknownSum = std::numeric_limits<std::int32_t>::min();

std::int32_t Add(std::int32_t sum, LogOddsUnits units) {
  if (units == kUnknownUnits) return sum;
  return sum == kUnknownSum ? units : sum + units;
}

}  // namespace

/// Answers at the centres of 8 x 8 x 8 global voxels, evaluated when they are asked for.
struct VogMap::Block {
  static constexpr int kVoxels = kBlockSide * kBlockSide * kBlockSide;

  std::vector<const PlacedSubmap*> candidates;   // Submaps that may know a voxel of the block.
  std::array<std::int32_t, kVoxels> closed_sum;  // Over the closed submaps, unclamped.
  std::bitset<kVoxels> has_closed_sum;
  std::array<float, kVoxels> answer;  // With the open submap, clamped.
  std::bitset<kVoxels> has_answer;    // Of the map's revision below.
  std::int64_t revision = -1;
};

VogMap::VogMap(double voxel_size_m, const SensorModel& model) : SubmapMap(voxel_size_m, model) {}

VogMap::~VogMap() = default;
VogMap::VogMap(VogMap&&) noexcept = default;

void VogMap::ReleaseCache() const {
  blocks_.clear();
  last_block_ = nullptr;
}

void VogMap::OnChange(SubmapId, const PlacedSubmap*, const PlacedSubmap*) { ReleaseCache(); }

void VogMap::SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
  for (std::size_t i = 0; i < voxels.size(); ++i)
    sigma_m[i] =
        static_cast<float>(SigmaAt(BlockOf(voxels[i]).candidates, grid().CenterOf(voxels[i])));
}

std::int32_t VogMap::SumAt(std::span<const PlacedSubmap* const> candidates, const Vec3& p_W) const {
  std::int32_t sum = kUnknownSum;
  for (const PlacedSubmap* placed : candidates) {
    const BrickGrid& grid = placed->submap->grid;
    sum = Add(sum, grid.Get(grid.grid().KeyOf(placed->X_MW * p_W)));
  }
  return sum;
}

float VogMap::WithOpen(std::int32_t closed_sum, const Vec3& p_W) const {
  std::int32_t sum = closed_sum;
  if (open() != nullptr) sum = Add(sum, open()->Get(open()->grid().KeyOf(X_open_W() * p_W)));
  return sum == kUnknownSum ? kUnknownLogOdds : ToLogOdds(model().Clamp(sum));
}

void VogMap::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  std::vector<const PlacedSubmap*> all;
  for (const auto& [id, placed] : placed()) all.push_back(&placed);
  for (std::size_t i = 0; i < points_W.size(); ++i)
    log_odds[i] = WithOpen(SumAt(all, points_W[i]), points_W[i]);
}

std::vector<const PlacedSubmap*> VogMap::CandidatesFor(const VoxelKey& block) const {
  const double side_m = kBlockSide * grid().voxel_size_m();
  const Vec3 center_W = side_m * Vec3(block.x + 0.5, block.y + 0.5, block.z + 0.5);
  const double radius_m = side_m * std::numbers::sqrt3 / 2;
  std::vector<const PlacedSubmap*> candidates;
  for (const auto& [id, placed] : placed()) {
    if (placed.bounds_M.squaredExteriorDistance(placed.X_MW * center_W) <= radius_m * radius_m)
      candidates.push_back(&placed);
  }
  return candidates;
}

VogMap::Block& VogMap::BlockOf(const VoxelKey& voxel) const {
  const VoxelKey key = BlockKeyOf(voxel);
  if (last_block_ != nullptr && key == last_block_key_) return *last_block_;
  std::unique_ptr<Block>& block = blocks_[key];
  if (block == nullptr) {
    block = std::make_unique<Block>();
    block->candidates = CandidatesFor(key);
  }
  last_block_key_ = key;
  last_block_ = block.get();
  return *block;
}

float VogMap::Evaluate(Block& block, int index, const VoxelKey& voxel) const {
  const Vec3 center_W = grid().CenterOf(voxel);
  if (!block.has_closed_sum[index]) {
    block.closed_sum[index] = SumAt(block.candidates, center_W);
    block.has_closed_sum[index] = true;
  }
  block.answer[index] = WithOpen(block.closed_sum[index], center_W);
  block.has_answer[index] = true;
  return block.answer[index];
}

float VogMap::LogOddsOfVoxel(const VoxelKey& voxel) const {
  Block& block = BlockOf(voxel);
  if (block.revision != revision()) {
    block.has_answer.reset();
    block.revision = revision();
  }
  const int index = IndexInBlock(voxel);
  return block.has_answer[index] ? block.answer[index] : Evaluate(block, index, voxel);
}

void VogMap::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  ReadVoxels(voxels, log_odds, [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

void VogMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  ReadBox(box, log_odds, [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

void VogMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                     std::vector<RayVoxel>& ray) const {
  WalkRay(origin_W, direction_W, range_m, ray,
          [this](const VoxelKey& voxel) { return LogOddsOfVoxel(voxel); });
}

}  // namespace vog
