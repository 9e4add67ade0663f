#include "lib/geometry/lane_walk.h"

namespace vog {

bool Supports(WalkForm form) {
#if defined(__x86_64__)
  return form == WalkForm::kBaseline || __builtin_cpu_supports("avx2");
#else
  return form == WalkForm::kBaseline;
#endif
}

}  // namespace vog
