#include "sim/world/world_options.h"

namespace vog {

Pose3 WorldOptions::StartPose() const {
  return MakePose(start_position_m, {0, 0, ToRadians(start_yaw_deg)});
}

Vec3 WorldOptions::StartError() const {
  return {start_error_x_m, start_error_y_m, ToRadians(start_error_yaw_deg)};
}

std::uint64_t NoiseSeed(std::uint64_t mission_seed, Time start) {
  constexpr std::uint64_t kSpread = 0x9E3779B97F4A7C15;  // Of SplitMix64.
  return mission_seed + kSpread * static_cast<std::uint64_t>(ToUtime(start));
}

}  // namespace vog
