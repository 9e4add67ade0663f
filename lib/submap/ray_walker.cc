#include "lib/submap/ray_walker.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace vog {
namespace {

constexpr std::int64_t kRecent = 1 << 14;
constexpr std::int64_t kNoKey = -1;

/// Whether a coordinate in voxels is within OctoMap's 2^16 keys; not a number never is.
bool HasKey(double coordinate) { return coordinate >= -32768 && coordinate < 32768; }

/// Without the call that std::floor is on processors of old.
std::int32_t Floor(double coordinate) {
  const auto truncated = static_cast<std::int32_t>(coordinate);
  return truncated - (coordinate < truncated);
}

}  // namespace

bool RayWalker::Supports(Form form) {
#if defined(__x86_64__)
  return form == Form::kBaseline || __builtin_cpu_supports("avx2");
#else
  return form == Form::kBaseline;
#endif
}

RayWalker::RayWalker(double voxel_size_m, Form form)
    : voxel_size_m_(voxel_size_m),
      voxels_per_m_(1 / voxel_size_m),
      form_(form),
      recent_(kRecent, kNoKey) {}

std::optional<VoxelKey> RayWalker::KeyOf(const Eigen::Vector3f& point) const {
  const double x = voxels_per_m_ * point.x(), y = voxels_per_m_ * point.y(),
               z = voxels_per_m_ * point.z();
  if (!HasKey(x) || !HasKey(y) || !HasKey(z)) return std::nullopt;
  return VoxelKey{Floor(x), Floor(y), Floor(z)};
}

void RayWalker::Collect(const std::vector<Ray>& rays) {
  passed_count_ = 0;
  lanes_ = {};
  int lane = 0;
  for (const Ray& ray : rays) {
    if (!Start(ray, lane) || ++lane < kLanes) continue;
    WalkLanes();
    lane = 0;
  }
  // Lanes without a ray stay at a voxel that another begins with.
  for (int idle = lane; idle < kLanes; ++idle) lanes_.key[idle] = lanes_.key[0];
  if (lane > 0) WalkLanes();
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

void RayWalker::WalkLanes() {
  const auto walks = [&] {
    return std::any_of(lanes_.walks, lanes_.walks + kLanes, [](auto walks) { return walks != 0; });
  };
  while (walks()) {
    if (form_ == Form::kAvx2)
      WalkRoundAvx2(lanes_, trace_);
    else
      WalkRoundBaseline(lanes_, trace_);
    Keep(trace_);
  }
}

// Makes the compiler forget that masks are comparisons. It would turn what is done with them into
// selections, and pick those apart for processors without an instruction for them.
#if defined(__x86_64__)
#define VOG_FORGET_MASKS(x, y, z) asm("" : "+x"(x), "+x"(y), "+x"(z))
#else
#define VOG_FORGET_MASKS(x, y, z)
#endif

template <int kWidth>
[[gnu::always_inline]] inline void RayWalker::WalkRoundBy(Lanes& lanes, Trace& trace) {
  typedef double Reals __attribute__((vector_size(kWidth * sizeof(double))));
  typedef std::int64_t Keys __attribute__((vector_size(kWidth * sizeof(std::int64_t))));
  typedef std::uint64_t Unsigned __attribute__((vector_size(kWidth * sizeof(std::uint64_t))));
  typedef std::int32_t Halves __attribute__((vector_size(kWidth * sizeof(std::int64_t))));
  constexpr int kVectors = kLanes / kWidth;
  struct Part {
    Reals x_m, y_m, z_m, x_delta_m, y_delta_m, z_delta_m, length_m;
    Keys x_step, y_step, z_step, key, end, walks;
  } parts[kVectors];
  const auto load = [](auto& vector, const auto* lanes) {
    std::memcpy(&vector, lanes, sizeof(vector));
  };
  const auto store = [](auto* lanes, const auto& vector) {
    std::memcpy(lanes, &vector, sizeof(vector));
  };
#pragma GCC unroll 4
  for (int i = 0; i < kVectors; ++i) {
    Part& part = parts[i];
    const int lane = i * kWidth;
    load(part.x_m, lanes.next_m[0] + lane);
    load(part.y_m, lanes.next_m[1] + lane);
    load(part.z_m, lanes.next_m[2] + lane);
    load(part.x_delta_m, lanes.delta_m[0] + lane);
    load(part.y_delta_m, lanes.delta_m[1] + lane);
    load(part.z_delta_m, lanes.delta_m[2] + lane);
    load(part.length_m, lanes.length_m + lane);
    load(part.x_step, lanes.step[0] + lane);
    load(part.y_step, lanes.step[1] + lane);
    load(part.z_step, lanes.step[2] + lane);
    load(part.key, lanes.key + lane);
    load(part.end, lanes.end + lane);
    load(part.walks, lanes.walks + lane);
  }
  for (int round = 0; round < kRound; ++round) {
#pragma GCC unroll 4
    for (int i = 0; i < kVectors; ++i) {
      Part& part = parts[i];
      store(trace.keys[round] + i * kWidth, part.key);
      Keys x_before_y = part.x_m < part.y_m, x_before_z = part.x_m < part.z_m,
           y_before_z = part.y_m < part.z_m;
      VOG_FORGET_MASKS(x_before_y, x_before_z, y_before_z);
      const Keys along_x = x_before_y & x_before_z;
      const Keys along_y = ~x_before_y & y_before_z;
      const Keys along_z = ~(along_x | along_y);
      part.x_m += (Reals)(along_x & (Keys)part.x_delta_m);
      part.y_m += (Reals)(along_y & (Keys)part.y_delta_m);
      part.z_m += (Reals)(along_z & (Keys)part.z_delta_m);
      const Keys step = (along_x & part.x_step) | (along_y & part.y_step) | (along_z & part.z_step);
      Keys x_within = part.x_m <= part.length_m, y_within = part.y_m <= part.length_m,
           z_within = part.z_m <= part.length_m;
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
    store(lanes.next_m[0] + lane, part.x_m);
    store(lanes.next_m[1] + lane, part.y_m);
    store(lanes.next_m[2] + lane, part.z_m);
    store(lanes.key + lane, part.key);
    store(lanes.walks + lane, part.walks);
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
  for (const Integers& keys : trace.keys)
#pragma GCC unroll 8
    for (const PackedKey key : keys) {
      PackedKey& recent = recent_[key & (kRecent - 1)];
      if (recent == key) continue;
      recent = *end++ = key;
    }
  passed_count_ = end - passed_.data();
}

}  // namespace vog
