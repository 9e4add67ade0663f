#include "lib/submap/ray_walker.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vog {
namespace {

constexpr std::int64_t kRecent = 1 << 14;
constexpr std::int64_t kNoKey = -1;

}  // namespace

RayWalker::RayWalker(double voxel_size_m, WalkForm form)
    : voxel_size_m_(voxel_size_m),
      voxels_per_m_(1 / voxel_size_m),
      form_(form),
      recent_(kRecent, kNoKey) {}

void RayWalker::Collect(const std::vector<Ray>& rays) {
  passed_count_ = 0;
  lanes_ = {};
  int lane = 0;
  for (const Ray& ray : rays) {
    if (!Start(ray, lane) || ++lane < kLanes) continue;
    WalkToEnds();
    lane = 0;
  }
  // Lanes without a ray stay at a voxel that another begins with.
  for (int idle = lane; idle < kLanes; ++idle) lanes_.key[idle] = lanes_.key[0];
  if (lane > 0) WalkToEnds();
  for (std::size_t i = 0; i < passed_count_; ++i) recent_[passed_[i] & (kRecent - 1)] = kNoKey;
}

// The arithmetic of OctoMap's OcTreeBaseImpl::computeRayKeys, in floats where that has floats.
bool RayWalker::Start(const Ray& ray, int lane) {
  const std::optional<VoxelKey> from = KeyOf(ray.from), to = KeyOf(ray.to);
  if (!from || !to || *from == *to) return false;
  const Eigen::Vector3f way = ray.to - ray.from;
  const double square = way.x() * way.x() + way.y() * way.y() + way.z() * way.z();
  const auto length_m = static_cast<float>(std::sqrt(square));
  const std::int32_t key[3] = {from->x, from->y, from->z};
  constexpr PackedKey kStep[3] = {kX, kY, kZ};
  for (int axis = 0; axis < 3; ++axis) {
    const float direction = way[axis] / length_m;
    const int step = direction > 0 ? 1 : direction < 0 ? -1 : 0;
    const double border_m =
        (key[axis] + 0.5) * voxel_size_m_ + static_cast<float>(step * voxel_size_m_ * 0.5);
    constexpr double kNever = std::numeric_limits<double>::max();
    lanes_.next_m[axis][lane] = step == 0 ? kNever : (border_m - ray.from[axis]) / direction;
    lanes_.delta_m[axis][lane] = step == 0 ? kNever : voxel_size_m_ / std::abs(direction);
    lanes_.step[axis][lane] = step * kStep[axis];
  }
  // A length that vanishes in floats gives no direction; the ray ends where it is.
  lanes_.length_m[lane] = length_m > 0 ? length_m : -1;
  lanes_.key[lane] = Pack(*from);
  lanes_.end[lane] = Pack(*to);
  lanes_.walks[lane] = -1;
  return true;
}

void RayWalker::WalkToEnds() {
  const auto walks = [&] {
    return std::any_of(lanes_.walks, lanes_.walks + kLanes, [](auto walks) { return walks != 0; });
  };
  while (walks()) {
    if (form_ == WalkForm::kAvx2)
      WalkRoundAvx2(lanes_, trace_);
    else
      WalkRoundBaseline(lanes_, trace_);
    Keep(trace_);
  }
}

template <int kWidth>
[[gnu::always_inline]] inline void RayWalker::WalkRoundBy(Lanes& lanes, Trace& trace) {
  using Vector = WalkVector<kWidth>;
  using Keys = typename Vector::Keys;
  typedef std::uint64_t Unsigned __attribute__((vector_size(kWidth * sizeof(std::uint64_t))));
  typedef std::int32_t Halves __attribute__((vector_size(kWidth * sizeof(std::int64_t))));
  constexpr int kVectors = kLanes / kWidth;
  struct Part {
    Vector ray;
    typename Vector::Reals length_m;
    Keys key, end, walks;
  } parts[kVectors];
#pragma GCC unroll 4
  for (int i = 0; i < kVectors; ++i) {
    Part& part = parts[i];
    const int lane = i * kWidth;
    part.ray.LoadFrom(lanes, lane);
    Vector::Load(part.length_m, lanes.length_m + lane);
    Vector::Load(part.key, lanes.key + lane);
    Vector::Load(part.end, lanes.end + lane);
    Vector::Load(part.walks, lanes.walks + lane);
  }
  for (int round = 0; round < kRound; ++round) {
#pragma GCC unroll 4
    for (int i = 0; i < kVectors; ++i) {
      Part& part = parts[i];
      Vector::Store(trace.keys[round] + i * kWidth, part.key);
      const Keys step = part.ray.Advance().step;
      Keys x_within = part.ray.x_m <= part.length_m, y_within = part.ray.y_m <= part.length_m,
           z_within = part.ray.z_m <= part.length_m;
      // In halves of keys, since SSE2 compares no more at a time.
      const Keys next = part.key + step;
      const Keys halves = (Keys)((Halves)next == (Halves)part.end);
      VOG_FORGET_MASKS(x_within, y_within, z_within);
      const Keys at_end = halves & (halves << 32 | (Keys)((Unsigned)halves >> 32));
      part.walks &= (x_within | y_within | z_within) & ~at_end;
      part.key += step & part.walks;
    }
  }
#pragma GCC unroll 4
  for (int i = 0; i < kVectors; ++i) {
    const Part& part = parts[i];
    const int lane = i * kWidth;
    part.ray.StoreTo(lanes, lane);
    Vector::Store(lanes.key + lane, part.key);
    Vector::Store(lanes.walks + lane, part.walks);
  }
}

void RayWalker::WalkRoundBaseline(Lanes& lanes, Trace& trace) { WalkRoundBy<2>(lanes, trace); }

#if defined(__x86_64__)
__attribute__((target("avx2")))
#endif
void RayWalker::WalkRoundAvx2(Lanes& lanes, Trace& trace) {
  WalkRoundBy<4>(lanes, trace);
}

void RayWalker::Keep(const Trace& trace) {
  constexpr std::size_t kTraced = kRound * kLanes;
  if (passed_.size() < passed_count_ + kTraced) passed_.resize(2 * passed_.size() + kTraced);
  PackedKey* end = passed_.data() + passed_count_;
  for (const WalkLanes::Integers& keys : trace.keys)
#pragma GCC unroll 8
    for (const PackedKey key : keys) {
      PackedKey& recent = recent_[key & (kRecent - 1)];
      if (recent == key) continue;
      recent = *end++ = key;
    }
  passed_count_ = end - passed_.data();
}

}  // namespace vog
