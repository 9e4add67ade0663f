#pragma once

#include "lib/occupancy/occupancy_map.h"

namespace vog {

/// Whether two maps give one answer: NaN, which is unknown, equals NaN.
inline bool IsSameAnswer(float a, float b) { return a == b || (!IsKnown(a) && !IsKnown(b)); }

}  // namespace vog
