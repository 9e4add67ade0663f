#include "sim/sensors/beam_caster.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vog {

BeamCaster::BeamCaster(const SonarOptions& options, const SonarModelOptions& model,
                       const RayCaster& scene)
    : model_(model), scene_(&scene), max_range_m_(options.max_range_m) {
  const double half_width = 0.5 * ToRadians(options.fov_deg) / options.beams;
  const double half_thickness = 0.5 * ToRadians(options.beam_thickness_deg);
  for (const double bearing : BeamBearings(options)) {
    for (int i = 0; i < model.rays_per_beam; ++i) {
      // A sunflower spiral fills the beam's ellipse evenly with any number of rays.
      const double radius = std::sqrt(static_cast<double>(i) / model.rays_per_beam);
      const double angle = 2 * std::numbers::pi * std::numbers::phi * i;
      const double elevation = half_thickness * radius * std::sin(angle);
      const Vec3 level_S = BeamDirection(bearing + half_width * radius * std::cos(angle));
      directions_S_.push_back(std::cos(elevation) * level_S + std::sin(elevation) * Vec3::UnitZ());
    }
  }
}

std::vector<BeamEchoes> BeamCaster::Cast(const Pose3& X_WS) const {
  std::vector<BeamEchoes> beams(directions_S_.size() / model_.rays_per_beam);
  for (std::size_t beam = 0; beam < beams.size(); ++beam) beams[beam] = CastBeam(X_WS, beam);
  return beams;
}

BeamEchoes BeamCaster::CastBeam(const Pose3& X_WS, std::size_t beam) const {
  std::vector<Echo> rays;
  for (int i = 0; i < model_.rays_per_beam; ++i) {
    const Vec3 direction_W = X_WS.linear() * directions_S_[beam * model_.rays_per_beam + i];
    const auto hit = scene_->Cast(X_WS.translation(), direction_W, max_range_m_);
    if (!hit) continue;
    const double comes_back = ComesBack(std::abs(hit->normal_W.dot(direction_W)));
    rays.push_back({hit->range_m, comes_back / model_.rays_per_beam});
  }
  return Cluster(std::move(rays));
}

double BeamCaster::ComesBack(double sine_of_grazing_angle) const {
  const double limit = std::sin(ToRadians(model_.grazing_limit_deg));
  if (sine_of_grazing_angle >= limit) return 1;
  return std::pow(sine_of_grazing_angle / limit, model_.grazing_exponent);
}

/// Joins rays whose ranges the sonar cannot tell apart.
BeamEchoes BeamCaster::Cluster(std::vector<Echo> rays) const {
  std::sort(rays.begin(), rays.end(),
            [](const Echo& a, const Echo& b) { return a.range_m < b.range_m; });
  BeamEchoes echoes;
  for (std::size_t first = 0, end = 0; first < rays.size(); first = end) {
    Echo sum;
    for (; end < rays.size() && rays[end].range_m <= rays[first].range_m + model_.range_cell_m;
         ++end) {
      sum.range_m += rays[end].share * rays[end].range_m;
      sum.share += rays[end].share;
    }
    if (sum.share > 0) echoes.push_back({sum.range_m / sum.share, sum.share});
  }
  return echoes;
}

}  // namespace vog
