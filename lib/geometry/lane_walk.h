#pragma once

#include <cstdint>
#include <cstring>

namespace vog {

/// The instructions to walk rays with, two or four at a time; the voxels are the same.
enum class WalkForm { kBaseline, kAvx2 };

bool Supports(WalkForm form);
inline WalkForm FastestWalkForm() {
  return Supports(WalkForm::kAvx2) ? WalkForm::kAvx2 : WalkForm::kBaseline;
}

/// Eight rays side by side on their way through a grid [Amanatides and Woo 1987].
struct alignas(32) WalkLanes {
  static constexpr int kLanes = 8;
  using Doubles = double[kLanes];
  using Integers = std::int64_t[kLanes];

  Doubles next_m[3];   ///< Where along the ray it leaves its voxel through a face across the axis.
  Doubles delta_m[3];  ///< Between two such faces.
  Integers step[3];    ///< To the voxel behind such a face, in keys of one number.
};

// Makes the compiler forget that masks are comparisons. It would turn what is done with them into
// selections, and pick those apart for processors without an instruction for them.
#if defined(__x86_64__)
#define VOG_FORGET_MASKS(x, y, z) asm("" : "+x"(x), "+x"(y), "+x"(z))
#else
#define VOG_FORGET_MASKS(x, y, z)
#endif

/// `kWidth` of the lanes in registers.
template <int kWidth>
struct WalkVector {
  typedef double Reals __attribute__((vector_size(kWidth * sizeof(double))));
  typedef std::int64_t Keys __attribute__((vector_size(kWidth * sizeof(std::int64_t))));

  template <class Vector, class Number>
  [[gnu::always_inline]] static void Load(Vector& vector, const Number* lanes) {
    std::memcpy(&vector, lanes, sizeof(vector));
  }
  template <class Number, class Vector>
  [[gnu::always_inline]] static void Store(Number* lanes, const Vector& vector) {
    std::memcpy(lanes, &vector, sizeof(vector));
  }

  [[gnu::always_inline]] void LoadFrom(const WalkLanes& lanes, int first) {
    Load(x_m, lanes.next_m[0] + first);
    Load(y_m, lanes.next_m[1] + first);
    Load(z_m, lanes.next_m[2] + first);
    Load(x_delta_m, lanes.delta_m[0] + first);
    Load(y_delta_m, lanes.delta_m[1] + first);
    Load(z_delta_m, lanes.delta_m[2] + first);
    Load(x_step, lanes.step[0] + first);
    Load(y_step, lanes.step[1] + first);
    Load(z_step, lanes.step[2] + first);
  }
  [[gnu::always_inline]] void StoreTo(WalkLanes& lanes, int first) const {
    Store(lanes.next_m[0] + first, x_m);
    Store(lanes.next_m[1] + first, y_m);
    Store(lanes.next_m[2] + first, z_m);
  }

  /// Passes the nearest face of each ray: how far along the ray it is, and the step behind it.
  struct Passed {
    Reals entered_m;
    Keys step;
  };
  [[gnu::always_inline]] Passed Advance() {
    Keys x_before_y = x_m < y_m, x_before_z = x_m < z_m, y_before_z = y_m < z_m;
    VOG_FORGET_MASKS(x_before_y, x_before_z, y_before_z);
    const Keys along_x = x_before_y & x_before_z;
    const Keys along_y = ~x_before_y & y_before_z;
    const Keys along_z = ~(along_x | along_y);
    const Passed passed{
        (Reals)((along_x & (Keys)x_m) | (along_y & (Keys)y_m) | (along_z & (Keys)z_m)),
        (along_x & x_step) | (along_y & y_step) | (along_z & z_step)};
    x_m += (Reals)(along_x & (Keys)x_delta_m);
    y_m += (Reals)(along_y & (Keys)y_delta_m);
    z_m += (Reals)(along_z & (Keys)z_delta_m);
    return passed;
  }

  Reals x_m, y_m, z_m, x_delta_m, y_delta_m, z_delta_m;
  Keys x_step, y_step, z_step;
};

}  // namespace vog
