#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/time.h"
#include "lib/geometry/odometry.h"
#include "lib/geometry/pose.h"

namespace vog {

enum class BeamStatus : std::int8_t {
  kReturn = 0,     ///< An echo at `range_m`; the way there is free.
  kClear = 1,      ///< Surely no echo: free up to the window's end.
  kUncertain = 2,  ///< No echo, and that says nothing.
};

struct Beam {
  float bearing_rad = 0;  ///< In S, to the left positive.
  float range_m = 0;      ///< Of the echo; 0 without one.
  float strength = 0;     ///< Of the echo, 0..1.
  BeamStatus status = BeamStatus::kUncertain;
};

/// One fan of ranges, all taken at one time.
struct Scan {
  Time time;
  std::int64_t sequence = 0;
  Pose3 X_BS = Pose3::Identity();  ///< The sonar in the body, with the servo's angle.
  double min_range_m = 0, max_range_m = 0;
  std::vector<Beam> beams;
};

/// A scan with the odometry of its moment.
struct RegisteredScan {
  Scan scan;
  OdometrySample odometry;
};

/// The points where beams met something, in the body frame.
std::vector<Vec3> EndPoints_B(const Scan& scan);

/// Decides which silent beams are sure: those farther than `guard_beams` from every beam with an
/// echo. At the rim of a structure, and where it is seen at a grazing angle, silence says nothing.
void ClassifySilentBeams(int guard_beams, std::vector<Beam>& beams);

}  // namespace vog
