#include "lib/geometry/view_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vog {

bool ViewWalk::Holds(const VoxelGrid& grid, const Vec3& origin, double length_m) {
  const double reach = (origin.cwiseAbs().maxCoeff() + length_m) / grid.voxel_size_m() + kRound;
  return reach < static_cast<double>(kOrigin);
}

ViewWalk::ViewWalk(const VoxelGrid& grid, WalkForm form) : grid_(grid), form_(form) { Clear(); }

void ViewWalk::Clear() {
  lanes_ = {};
  std::fill_n(lanes_.length_m, kLanes, -1);
  std::fill_n(lanes_.entered_m, kLanes, std::numeric_limits<double>::quiet_NaN());
}

// The arithmetic of WalkVoxels().
void ViewWalk::Start(int lane, const Vec3& origin, const Vec3& direction, double length_m) {
  const VoxelKey key = grid_.KeyOf(origin);
  const std::int32_t index[3] = {key.x, key.y, key.z};
  for (int axis = 0; axis < 3; ++axis) {
    const double border_m = (index[axis] + (direction[axis] > 0 ? 1 : 0)) * grid_.voxel_size_m();
    const bool moves = direction[axis] != 0;
    lanes_.next_m[axis][lane] =
        moves ? (border_m - origin[axis]) / direction[axis] : std::numeric_limits<double>::max();
    lanes_.delta_m[axis][lane] = moves ? grid_.voxel_size_m() / std::abs(direction[axis]) : 0;
    lanes_.step[axis][lane] =
        PackedKey{direction[axis] > 0 ? 1 : -1} * (PackedKey{1} << (axis * kBits));
  }
  lanes_.length_m[lane] = length_m;
  lanes_.entered_m[lane] = 0;
  lanes_.key[lane] = Pack(key);
}

const ViewWalk::Round& ViewWalk::Next() {
  if (form_ == WalkForm::kAvx2)
    WalkRoundAvx2(lanes_, round_);
  else
    WalkRoundBaseline(lanes_, round_);
  return round_;
}

template <int kWidth>
[[gnu::always_inline]] inline void ViewWalk::WalkRoundBy(Lanes& lanes, Round& round) {
  using Vector = WalkVector<kWidth>;
  using Keys = typename Vector::Keys;
  using Reals = typename Vector::Reals;
  constexpr int kVectors = kLanes / kWidth;
  struct Part {
    Vector ray;
    Reals length_m, entered_m;
    Keys key;
  } parts[kVectors];
#pragma GCC unroll 4
  for (int i = 0; i < kVectors; ++i) {
    Part& part = parts[i];
    const int lane = i * kWidth;
    part.ray.LoadFrom(lanes, lane);
    Vector::Load(part.length_m, lanes.length_m + lane);
    Vector::Load(part.entered_m, lanes.entered_m + lane);
    Vector::Load(part.key, lanes.key + lane);
  }
  for (int step = 0; step < kRound; ++step) {
#pragma GCC unroll 4
    for (int i = 0; i < kVectors; ++i) {
      Part& part = parts[i];
      Vector::Store(round.key[step] + i * kWidth, part.key);
      Vector::Store(round.entered_m[step] + i * kWidth, part.entered_m);
      const auto passed = part.ray.Advance();
      // All bits set is not a number; and once past its end, a ray stays there.
      const Keys is_over = ~(Keys)(passed.entered_m <= part.length_m);
      part.entered_m = (Reals)((Keys)passed.entered_m | is_over);
      part.key += passed.step & ~is_over;
    }
  }
#pragma GCC unroll 4
  for (int i = 0; i < kVectors; ++i) {
    const Part& part = parts[i];
    const int lane = i * kWidth;
    part.ray.StoreTo(lanes, lane);
    Vector::Store(lanes.entered_m + lane, part.entered_m);
    Vector::Store(lanes.key + lane, part.key);
  }
}

void ViewWalk::WalkRoundBaseline(Lanes& lanes, Round& round) { WalkRoundBy<2>(lanes, round); }

#if defined(__x86_64__)
__attribute__((target("avx2")))
#endif
void ViewWalk::WalkRoundAvx2(Lanes& lanes, Round& round) {
  WalkRoundBy<4>(lanes, round);
}

}  // namespace vog
