#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/random.h"
#include "lib/scan/sonar_records.h"
#include "sim/sensors/beam_caster.h"
#include "sim/sensors/frame_painter.h"

namespace vog {

/// A profiling sonar in a scene, on its servo. Ping `sequence` draws its noise from
/// Random(seed, "sonar", sequence).
class SonarSimulator {
 public:
  /// `scene` must outlive the simulator. @throws UsageError like the options' Validate().
  SonarSimulator(const SonarOptions& options, const SonarModelOptions& model,
                 const RayCaster& scene, std::uint64_t seed);

  /// A ping of a sonar that finds the ranges itself: in each beam the nearest surface that it
  /// detects, inside the window. What stands nearer than the window hides what is behind it.
  SonarReturns Returns(Time time, std::int64_t sequence, const Pose3& X_WB) const;

  /// A ping of an imaging sonar.
  SonarFrame Frame(Time time, std::int64_t sequence, const Pose3& X_WB) const;

 private:
  std::vector<BeamEchoes> Ping(Time time, const Pose3& X_WB) const;
  Echo Detect(const BeamEchoes& echoes, Random& random) const;
  Echo Hear(const BeamEchoes& echoes, Random& random) const;
  Echo WithCrosstalk(const std::vector<Echo>& heard, int beam, Random& random) const;
  bool InWindow(double range_m) const;

  SonarOptions options_;
  SonarModelOptions model_;
  std::uint64_t seed_;
  BeamCaster caster_;
  FramePainter painter_;
};

}  // namespace vog
