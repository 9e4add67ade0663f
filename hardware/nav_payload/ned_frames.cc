#include "hardware/nav_payload/ned_frames.h"

#include <numbers>

namespace vog {

RollPitchYaw FromNed(const NedAttitude& attitude) {
  return {attitude.roll_rad, -attitude.pitch_rad,
          WrapAngle(std::numbers::pi / 2 - attitude.heading_rad)};
}

NedAttitude ToNed(const RollPitchYaw& angles) {
  const double heading_rad = WrapAngle(std::numbers::pi / 2 - angles.yaw);
  return {heading_rad < 0 ? heading_rad + 2 * std::numbers::pi : heading_rad, -angles.pitch,
          angles.roll};
}

}  // namespace vog
