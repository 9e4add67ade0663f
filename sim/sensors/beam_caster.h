#pragma once

#include <vector>

#include "lib/scan/sonar.h"
#include "sim/scene/ray_caster.h"
#include "sim/sensors/sonar_model_options.h"

namespace vog {

/// A surface that a beam meets.
struct Echo {
  double range_m = 0;
  double share = 0;  ///< Of the beam's rays that meet it, each weighted by how well it comes back.
};

/// From near to far.
using BeamEchoes = std::vector<Echo>;

/// Casts the sonar's beams: each is a bundle of rays over its width and thickness, the first in its
/// middle. Without noise.
class BeamCaster {
 public:
  /// `scene` must outlive the caster.
  BeamCaster(const SonarOptions& options, const SonarModelOptions& model, const RayCaster& scene);

  /// What each beam meets up to the window's end, also nearer than its start.
  std::vector<BeamEchoes> Cast(const Pose3& X_WS) const;

 private:
  BeamEchoes CastBeam(const Pose3& X_WS, std::size_t beam) const;
  double ComesBack(double sine_of_grazing_angle) const;
  BeamEchoes Cluster(std::vector<Echo> rays) const;

  SonarModelOptions model_;
  const RayCaster* scene_;
  double max_range_m_;
  std::vector<Vec3> directions_S_;  // model_.rays_per_beam of each beam.
};

}  // namespace vog
