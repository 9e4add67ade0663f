#include "lib/vogmap/lane_sum.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace vog {
namespace {

// Places are within 14 voxels of the first voxel's, so that float errs by less than 1e-5.
constexpr float kBorder = 1e-4f;

std::atomic<bool> wide_allowed = true;

VoxelKey VoxelAt(const VoxelKey& block, const VoxelKey& offset) {
  return {block.x * kBlockSide + offset.x, block.y * kBlockSide + offset.y,
          block.z * kBlockSide + offset.z};
}

/// The centres of a block's voxels as a submap sees them [voxels of M].
struct BlockBox {
  BlockBox(const PlacedSubmap& submap, const VoxelGrid& grid, const Vec3& first_W)
      : bricks(submap.submap->grid), first_M((submap.X_MW * first_W) / voxel_size_m()) {
    const Mat3 side =
        (kBlockSide - 1) * grid.voxel_size_m() / voxel_size_m() * submap.X_MW.linear();
    middle = first_M + 0.5 * side.rowwise().sum();
    constexpr double kSlack = 1e-6;
    half = 0.5 * side.cwiseAbs().rowwise().sum() + Vec3::Constant(kSlack);
  }

  double voxel_size_m() const { return bricks.grid().voxel_size_m(); }
  bool HasBrick() const {
    const VoxelGrid voxels(1);
    return bricks.HasBrickIn(voxels.KeyOf(middle - half), voxels.KeyOf(middle + half));
  }

  const BrickGrid& bricks;
  Vec3 first_M, middle, half;
};

/// The definition: what the lanes must come to.
[[gnu::noinline]] void AddExactly(const PlacedSubmap& placed, std::int32_t sign,
                                  const VoxelGrid& grid, const VoxelKey& voxel, VoxelSum& sum) {
  const BrickGrid& bricks = placed.submap->grid;
  const LogOddsUnits units = bricks.Get(bricks.grid().KeyOf(placed.X_MW * grid.CenterOf(voxel)));
  if (units != kUnknownUnits) sum.Add(units, sign);
}

void AddExactly(const CandidateLanes& group, unsigned lanes, const VoxelGrid& grid,
                const VoxelKey& voxel, VoxelSum& sum) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
    AddExactly(*group.placed[lane], group.sign[lane], grid, voxel, sum);
  }
}

// --- One lane at a time ---

/// A lane's place along one axis: the voxel, from the table's corner, and whether float can tell.
struct AxisPlace {
  std::int32_t voxel;
  bool is_sure;
};

AxisPlace PlaceAlong(std::size_t axis, std::size_t lane, const CandidateLanes& group,
                     const float (&offset)[3]) {
  const float place = group.within[axis][lane] + group.R_MW[3 * axis][lane] * offset[0] +
                      group.R_MW[3 * axis + 1][lane] * offset[1] +
                      group.R_MW[3 * axis + 2][lane] * offset[2];
  auto whole = static_cast<std::int32_t>(place);
  whole -= static_cast<float>(whole) > place;
  const float within = place - static_cast<float>(whole);
  return {group.voxel_M[axis][lane] + whole, within > kBorder && within < 1 - kBorder};
}

void AddLane(std::size_t lane, const CandidateLanes& group, const VoxelGrid& grid,
             const VoxelKey& voxel, const float (&offset)[3], VoxelSum& sum) {
  const AxisPlace x = PlaceAlong(0, lane, group, offset), y = PlaceAlong(1, lane, group, offset),
                  z = PlaceAlong(2, lane, group, offset);
  if (!x.is_sure || !y.is_sure || !z.is_sure) {
    AddExactly(*group.placed[lane], group.sign[lane], grid, voxel, sum);
    return;
  }
  const auto brick = [](const AxisPlace& place) {
    return static_cast<std::uint32_t>(place.voxel) >> BrickGrid::kBrickBits;
  };
  const auto last = [&](std::size_t axis) {
    return static_cast<std::uint32_t>(group.last_brick[axis][lane]);
  };
  if (brick(x) > last(0) || brick(y) > last(1) || brick(z) > last(2)) return;
  const std::uint16_t number =
      group.table[lane][(brick(z) * (last(1) + 1) + brick(y)) * (last(0) + 1) + brick(x)];
  if (number == BrickGrid::kNoBrick) return;
  const int index = BrickGrid::IndexInBrick({x.voxel, y.voxel, z.voxel});
  const LogOddsUnits units = group.values[lane][number * BrickGrid::kBrickVoxels + index];
  if (units != kUnknownUnits) sum.Add(units, group.sign[lane]);
}

void SumNarrow(const std::vector<CandidateLanes>& candidates, const VoxelGrid& grid,
               const VoxelKey& block, std::span<const int> voxels, std::span<VoxelSum> sums) {
  for (const CandidateLanes& group : candidates)
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      const VoxelKey offset = OffsetInBlock(voxels[i]);
      const float along[3] = {static_cast<float>(offset.x), static_cast<float>(offset.y),
                              static_cast<float>(offset.z)};
      for (std::size_t lane = 0; lane < kLanes && group.placed[lane] != nullptr; ++lane)
        AddLane(lane, group, grid, VoxelAt(block, offset), along, sums[i]);
    }
}

// --- Eight lanes at a time ---

#if defined(__x86_64__)
#define VOG_WIDE __attribute__((target("avx2,fma")))

/// Eight lanes' places along one axis, as AxisPlace. `is_unsure`: ones where float cannot tell.
struct WideAxis {
  __m256i voxel;
  __m256 is_unsure;
};

VOG_WIDE inline __m256i Load(const std::array<std::int32_t, kLanes>& numbers) {
  return _mm256_load_si256(reinterpret_cast<const __m256i*>(numbers.data()));
}
VOG_WIDE inline __m256 Load(const std::array<float, kLanes>& numbers) {
  return _mm256_load_ps(numbers.data());
}

VOG_WIDE inline WideAxis PlaceAlong(std::size_t axis, const CandidateLanes& group, __m256 dx,
                                    __m256 dy, __m256 dz) {
  __m256 place = _mm256_fmadd_ps(Load(group.R_MW[3 * axis]), dx, Load(group.within[axis]));
  place = _mm256_fmadd_ps(Load(group.R_MW[3 * axis + 1]), dy, place);
  place = _mm256_fmadd_ps(Load(group.R_MW[3 * axis + 2]), dz, place);
  const __m256 whole = _mm256_floor_ps(place);
  const __m256 from_middle = _mm256_andnot_ps(
      _mm256_set1_ps(-0.0f), _mm256_sub_ps(_mm256_sub_ps(place, whole), _mm256_set1_ps(0.5f)));
  return {_mm256_add_epi32(Load(group.voxel_M[axis]), _mm256_cvttps_epi32(whole)),
          _mm256_cmp_ps(from_middle, _mm256_set1_ps(0.5f - kBorder), _CMP_GT_OQ)};
}

/// Reads 32 bits at `bases[lane] + offset` of the lanes in `mask`; the others get `otherwise`.
template <class T>
VOG_WIDE inline __m256i Gather(const std::array<const T*, kLanes>& bases, __m256i byte_offset,
                               __m256i mask, __m256i otherwise) {
  const auto half = [&](int part, __m128i offset, __m128i in, __m128i out) VOG_WIDE {
    const __m256i base =
        _mm256_load_si256(reinterpret_cast<const __m256i*>(bases.data() + 4 * part));
    const __m256i address = _mm256_add_epi64(base, _mm256_cvtepi32_epi64(offset));
    return _mm256_mask_i64gather_epi32(out, static_cast<const int*>(nullptr), address, in, 1);
  };
  const __m128i low = half(0, _mm256_castsi256_si128(byte_offset), _mm256_castsi256_si128(mask),
                           _mm256_castsi256_si128(otherwise));
  const __m128i high =
      half(1, _mm256_extracti128_si256(byte_offset, 1), _mm256_extracti128_si256(mask, 1),
           _mm256_extracti128_si256(otherwise, 1));
  return _mm256_set_m128i(high, low);
}

/// Brick numbers at `place` in the lanes' tables. Two entries are read at once, the second of which
/// is the one unless it is the table's first: never past a table's end.
VOG_WIDE inline __m256i BrickNumbers(const CandidateLanes& group, __m256i place, __m256i mask) {
  const __m256i has_before = _mm256_cmpgt_epi32(place, _mm256_setzero_si256());
  const __m256i pairs =
      Gather(group.table, _mm256_slli_epi32(_mm256_add_epi32(place, has_before), 1), mask,
             _mm256_set1_epi32(-1));
  const __m256i shift = _mm256_and_si256(has_before, _mm256_set1_epi32(16));
  return _mm256_and_si256(_mm256_srlv_epi32(pairs, shift), _mm256_set1_epi32(0xffff));
}

/// Log-odds units at `place` in the lanes' values; 0 outside `mask`. A brick is a multiple of four
/// bytes, so that whole words can be read.
VOG_WIDE inline __m256i Values(const CandidateLanes& group, __m256i place, __m256i mask) {
  const __m256i word = _mm256_andnot_si256(_mm256_set1_epi32(3), place);
  const __m256i bytes = Gather(group.values, word, mask, _mm256_setzero_si256());
  const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(place, _mm256_set1_epi32(3)), 3);
  return _mm256_srai_epi32(_mm256_slli_epi32(_mm256_srlv_epi32(bytes, shift), 24), 24);
}

VOG_WIDE inline __m256i IsWithin(__m256i brick, __m256i last) {
  return _mm256_cmpeq_epi32(_mm256_min_epu32(brick, last), brick);
}

VOG_WIDE inline int MaskOf(__m256i lanes) { return _mm256_movemask_ps(_mm256_castsi256_ps(lanes)); }

VOG_WIDE inline std::int32_t SumOf(__m256i numbers) {
  __m128i sum =
      _mm_add_epi32(_mm256_castsi256_si128(numbers), _mm256_extracti128_si256(numbers, 1));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0x4e));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0xb1));
  return _mm_cvtsi128_si32(sum);
}

/// Which lanes have a brick at a place among those in `in`, and the number of it.
struct WideBricks {
  __m256i number, in;
};

VOG_WIDE inline WideBricks BricksAt(const CandidateLanes& group, const WideAxis& x,
                                    const WideAxis& y, const WideAxis& z, __m256i in) {
  const __m256i brick_x = _mm256_srli_epi32(x.voxel, BrickGrid::kBrickBits),
                brick_y = _mm256_srli_epi32(y.voxel, BrickGrid::kBrickBits),
                brick_z = _mm256_srli_epi32(z.voxel, BrickGrid::kBrickBits);
  const __m256i last_x = Load(group.last_brick[0]), last_y = Load(group.last_brick[1]),
                last_z = Load(group.last_brick[2]);
  in = _mm256_and_si256(in, IsWithin(brick_x, last_x));
  in = _mm256_and_si256(in, IsWithin(brick_y, last_y));
  in = _mm256_and_si256(in, IsWithin(brick_z, last_z));
  if (MaskOf(in) == 0) return {in, in};
  const __m256i one = _mm256_set1_epi32(1);
  const __m256i row =
      _mm256_add_epi32(_mm256_mullo_epi32(brick_z, _mm256_add_epi32(last_y, one)), brick_y);
  const __m256i entry =
      _mm256_add_epi32(_mm256_mullo_epi32(row, _mm256_add_epi32(last_x, one)), brick_x);
  const __m256i number = BrickNumbers(group, entry, in);
  const __m256i none = _mm256_cmpeq_epi32(number, _mm256_set1_epi32(BrickGrid::kNoBrick));
  return {number, _mm256_andnot_si256(none, in)};
}

/// As BrickGrid::IndexInBrick().
VOG_WIDE inline __m256i IndexInBrick(const WideAxis& x, const WideAxis& y, const WideAxis& z) {
  const __m256i mask = _mm256_set1_epi32(BrickGrid::kBrickSide - 1);
  const __m256i zs = _mm256_slli_epi32(_mm256_and_si256(z.voxel, mask), 2 * BrickGrid::kBrickBits);
  const __m256i ys = _mm256_slli_epi32(_mm256_and_si256(y.voxel, mask), BrickGrid::kBrickBits);
  return _mm256_or_si256(_mm256_or_si256(zs, ys), _mm256_and_si256(x.voxel, mask));
}

/// Where the values of a voxel are: the lanes `in` which there is one.
struct WidePlace {
  __m256i place, in;
};

/// The sums of a voxel, a part in each lane.
struct WideSum {
  __m256i units, observers;
};

VOG_WIDE inline WidePlace PlaceOf(const CandidateLanes& group, const VoxelGrid& grid,
                                  const VoxelKey& block, int voxel, VoxelSum& exact) {
  const VoxelKey offset = OffsetInBlock(voxel);
  const __m256 dx = _mm256_set1_ps(static_cast<float>(offset.x)),
               dy = _mm256_set1_ps(static_cast<float>(offset.y)),
               dz = _mm256_set1_ps(static_cast<float>(offset.z));
  const WideAxis x = PlaceAlong(0, group, dx, dy, dz), y = PlaceAlong(1, group, dx, dy, dz),
                 z = PlaceAlong(2, group, dx, dy, dz);
  const __m256 unsure = _mm256_or_ps(_mm256_or_ps(x.is_unsure, y.is_unsure), z.is_unsure);
  const auto unsure_lanes = static_cast<unsigned>(_mm256_movemask_ps(unsure));
  if (unsure_lanes != 0) AddExactly(group, unsure_lanes, grid, VoxelAt(block, offset), exact);
  const __m256i sure = _mm256_xor_si256(_mm256_castps_si256(unsure), _mm256_set1_epi32(-1));
  const WideBricks bricks = BricksAt(group, x, y, z, sure);
  const __m256i first = _mm256_slli_epi32(bricks.number, 3 * BrickGrid::kBrickBits);
  return {_mm256_or_si256(first, IndexInBrick(x, y, z)), bricks.in};
}

/// Asks for the values early: most are far from the processor where there are many submaps.
VOG_WIDE inline void Prefetch(const CandidateLanes& group, const WidePlace& at) {
  alignas(32) std::array<std::int32_t, kLanes> place;
  _mm256_store_si256(reinterpret_cast<__m256i*>(place.data()), at.place);
  for (auto left = static_cast<unsigned>(MaskOf(at.in)); left != 0; left &= left - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(left));
    _mm_prefetch(reinterpret_cast<const char*>(group.values[lane]) + place[lane], _MM_HINT_T0);
  }
}

VOG_WIDE inline void AddValues(const CandidateLanes& group, const WidePlace& at, WideSum& sum) {
  if (MaskOf(at.in) == 0) return;
  const __m256i values = Values(group, at.place, at.in);
  const __m256i known =
      _mm256_andnot_si256(_mm256_cmpeq_epi32(values, _mm256_set1_epi32(kUnknownUnits)), at.in);
  const __m256i sign = _mm256_and_si256(Load(group.sign), known);
  sum.units = _mm256_add_epi32(sum.units, _mm256_sign_epi32(values, sign));
  sum.observers = _mm256_add_epi32(sum.observers, sign);
}

VOG_WIDE void SumWide(const std::vector<CandidateLanes>& candidates, const VoxelGrid& grid,
                      const VoxelKey& block, std::span<const int> voxels,
                      std::span<VoxelSum> sums) {
  std::array<WidePlace, kBlockVoxels> places;
  std::array<WideSum, kBlockVoxels> wide;
  std::fill_n(wide.begin(), voxels.size(), WideSum{_mm256_setzero_si256(), _mm256_setzero_si256()});
  for (const CandidateLanes& group : candidates) {
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      places[i] = PlaceOf(group, grid, block, voxels[i], sums[i]);
      Prefetch(group, places[i]);
    }
    for (std::size_t i = 0; i < voxels.size(); ++i) AddValues(group, places[i], wide[i]);
  }
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    sums[i].units += SumOf(wide[i].units);
    sums[i].observers += SumOf(wide[i].observers);
  }
}

bool HasWide() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}
#endif

}  // namespace

void AllowWideInstructions(bool allow) { wide_allowed = allow; }

SubmapLanes::SubmapLanes() {
  for (int lane = 0; lane < kLanes; ++lane) Set(lane, nullptr, 1);
}

void SubmapLanes::Set(int lane, const PlacedSubmap* submap, double voxel_size_m,
                      std::int32_t sign) {
  const auto i = static_cast<std::size_t>(lane);
  placed_[i] = submap;
  sign_[i] = sign;
  for (auto& row : min_M_) row[i] = std::numeric_limits<float>::infinity();
  if (submap == nullptr || submap->bounds_M.isEmpty()) return;
  const double voxels_per_m = 1 / submap->submap->grid.grid().voxel_size_m();
  for (int axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<std::size_t>(axis);
    const Vec3 R = submap->X_MW.linear().row(axis) * voxel_size_m * voxels_per_m;
    for (int col = 0; col < 3; ++col)
      R_MW_[3 * row + static_cast<std::size_t>(col)][i] = static_cast<float>(R[col]);
    // The centres of a block's voxels lie in a box around its middle.
    constexpr double kSlack = 0.1;
    const double half = 0.5 * (kBlockSide - 1) * R.cwiseAbs().sum() + kSlack;
    p_MW_[row][i] = static_cast<float>(submap->X_MW.translation()[axis] * voxels_per_m);
    min_M_[row][i] = static_cast<float>(submap->bounds_M.min()[axis] * voxels_per_m - half);
    max_M_[row][i] = static_cast<float>(submap->bounds_M.max()[axis] * voxels_per_m + half);
  }
}

unsigned SubmapLanes::MayKnow(const std::array<float, 3>& middle_W) const {
  std::array<std::int32_t, kLanes> is_in;
  is_in.fill(1);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float at = R_MW_[3 * row][i] * middle_W[0] + R_MW_[3 * row + 1][i] * middle_W[1] +
                       R_MW_[3 * row + 2][i] * middle_W[2] + p_MW_[row][i];
      is_in[i] &= static_cast<int>(at >= min_M_[row][i]) & static_cast<int>(at <= max_M_[row][i]);
    }
  unsigned lanes = 0;
  for (std::size_t i = 0; i < kLanes; ++i) lanes |= static_cast<unsigned>(is_in[i]) << i;
  return lanes;
}

CandidateLanes::CandidateLanes() {
  for (auto& row : within) row.fill(0.5f);
  for (auto& row : voxel_M) row.fill(std::numeric_limits<std::int32_t>::min());
}

void CandidateLanes::Set(int lane, const PlacedSubmap& submap, std::int32_t of_sign,
                         const VoxelGrid& grid, const Vec3& first_M) {
  const auto i = static_cast<std::size_t>(lane);
  const BrickGrid& bricks = submap.submap->grid;
  const double voxels_a_voxel = grid.voxel_size_m() / bricks.grid().voxel_size_m();
  const VoxelKey voxel = VoxelGrid(1).KeyOf(first_M), origin = bricks.table_origin();
  const std::int32_t key[3] = {voxel.x, voxel.y, voxel.z};
  const std::int32_t corner[3] = {origin.x, origin.y, origin.z};
  for (int axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<std::size_t>(axis);
    for (int col = 0; col < 3; ++col)
      R_MW[3 * row + static_cast<std::size_t>(col)][i] =
          static_cast<float>(voxels_a_voxel * submap.X_MW.linear()(axis, col));
    within[row][i] = static_cast<float>(first_M[axis] - key[axis]);
    voxel_M[row][i] = key[axis] - BrickGrid::kBrickSide * corner[axis];
    last_brick[row][i] = static_cast<std::int32_t>(bricks.table_size()[row]) - 1;
  }
  table[i] = bricks.table();
  values[i] = bricks.values();
  placed[i] = &submap;
  sign[i] = of_sign;
}

std::vector<CandidateLanes> CandidatesOf(const std::vector<SubmapLanes>& submaps,
                                         const VoxelGrid& grid, const VoxelKey& block) {
  constexpr float kHalf = 0.5f * kBlockSide;
  const std::array<float, 3> middle_W = {static_cast<float>(block.x * kBlockSide) + kHalf,
                                         static_cast<float>(block.y * kBlockSide) + kHalf,
                                         static_cast<float>(block.z * kBlockSide) + kHalf};
  const Vec3 first_W = grid.CenterOf(VoxelAt(block, {0, 0, 0}));
  std::vector<CandidateLanes> candidates;
  int count = 0;
  for (const SubmapLanes& group : submaps)
    for (unsigned left = group.MayKnow(middle_W); left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const PlacedSubmap& submap = *group.placed(lane);
      const BlockBox box(submap, grid, first_W);
      if (!box.HasBrick()) continue;
      if (count % kLanes == 0) candidates.emplace_back();
      candidates.back().Set(count++ % kLanes, submap, group.sign(lane), grid, box.first_M);
    }
  return candidates;
}

void SumCandidates(const std::vector<CandidateLanes>& candidates, const VoxelGrid& grid,
                   const VoxelKey& block, std::span<const int> voxels, std::span<VoxelSum> sums) {
  std::fill(sums.begin(), sums.end(), VoxelSum{});
#if defined(__x86_64__)
  if (HasWide() && wide_allowed.load(std::memory_order_relaxed)) {
    SumWide(candidates, grid, block, voxels, sums);
    return;
  }
#endif
  SumNarrow(candidates, grid, block, voxels, sums);
}

}  // namespace vog
