#pragma once

#include "lib/geometry/pose.h"

namespace vog {

/// Attitude as instruments say it: of FRD (x forward, y starboard, z down) in NED (north, east,
/// down). Heading from north to east, pitch with the bow up, roll with starboard down positive.
struct NedAttitude {
  double heading_rad = 0, pitch_rad = 0, roll_rad = 0;
};

/// The angles of X_WB, W being ENU and B FLU: yaw = pi/2 - heading in (-pi, pi], pitch changes its
/// sign, roll stays.
RollPitchYaw FromNed(const NedAttitude& attitude);
/// Its inverse, heading in [0, 2 pi).
NedAttitude ToNed(const RollPitchYaw& angles);

/// A vector along forward, starboard, down, in B; the same turns B's back.
inline Vec3 SwapFrdFlu(const Vec3& v) { return {v.x(), -v.y(), -v.z()}; }
/// A vector along north, east, down, in W; the same turns W's back.
inline Vec3 SwapNedEnu(const Vec3& v) { return {v.y(), v.x(), -v.z()}; }

}  // namespace vog
