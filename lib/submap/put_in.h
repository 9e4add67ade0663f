#pragma once

#include "lib/base/config.h"
#include "lib/base/time.h"
#include "lib/geometry/pose.h"

namespace vog {

/// Where the vehicle was when a mission ended, or where it is put in for the next flight, as the
/// mission's map knows it.
struct PlaceInMap {
  Time time;
  Pose3 X_ME = Pose3::Identity();  ///< The body E in the frame M of the map's last submap.
  Mat3 covariance = Mat3::Zero();  ///< Of (x, y, yaw) of the motion from there.
};

/// Where a flight on the map of earlier ones begins.
enum class PutInPlace {
  kEnd,    ///< Where the last one ended.
  kStart,  ///< Where the first one began.
  kPlace,  ///< At a place in W.
};

/// Table [put_in]: how a mission that goes on from a map, map.resume, begins.
struct PutInOptions {
  PutInPlace place = PutInPlace::kEnd;
  Vec3 position_m = {0, 0, 0};
  double yaw_deg = 0;
  double sigma_m = 0.3;
  double sigma_yaw_deg = 2;

  void Visit(OptionsVisitor& v) {
    v("place", place,
      Names<PutInPlace>{
          {PutInPlace::kEnd, "end"}, {PutInPlace::kStart, "start"}, {PutInPlace::kPlace, "place"}},
      "where the vehicle is at its first scan: where the last flight ended, where the first one "
      "began, or at position_m");
    v("position_m", position_m, Between(-1e5, 1e5), "the place in W, with place = \"place\"");
    v("yaw_deg", yaw_deg, Between(-360, 360), "and the heading there");
    v("sigma_m", sigma_m, Between(0.001, 100),
      "standard deviation of how far from there it is put in, in x and in y");
    v("sigma_yaw_deg", sigma_yaw_deg, Between(0.01, 180), "and how far it is turned");
  }
};

}  // namespace vog
