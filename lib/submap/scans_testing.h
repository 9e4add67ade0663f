#pragma once

#include "lib/base/random.h"
#include "lib/scan/scan.h"

/// Scans and odometry for tests.
namespace vog {

inline Scan RandomScan(Time time, Random& random) {
  Scan scan{
      time, ToUtime(time), MakePose({0.1, 0, -0.1}, {0, random.Uniform(-0.6, 0.6), 0}), 0.375, 4,
      {}};
  for (int i = 0; i < 24; ++i) {
    Beam beam{static_cast<float>(0.02 * (i - 12)), 0, 0.5f,
              static_cast<BeamStatus>(random.Index(3))};
    if (beam.status == BeamStatus::kReturn)
      beam.range_m = static_cast<float>(random.Uniform(0.2, 4));
    scan.beams.push_back(beam);
  }
  return scan;
}

/// A scan of a vehicle on a straight and slowly turning course, whose drift grows as it goes.
inline RegisteredScan ScanOnCourse(int step, std::int64_t segment, Random& random) {
  const Time time = FromUtime(200'000 * (step + 1));
  OdometrySample sample;
  sample.time = time;
  sample.origin = sample.segment = segment;
  sample.X_OB = MakePose({0.05 * step, 0.01 * step, -2 + 0.001 * step}, {0.01, -0.02, 0.02 * step});
  sample.covariance = step * 1e-4 * Vec3(1, 1, 0.01).asDiagonal().toDenseMatrix();
  return {RandomScan(time, random), sample};
}

}  // namespace vog
