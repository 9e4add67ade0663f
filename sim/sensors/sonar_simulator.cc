#include "sim/sensors/sonar_simulator.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr Echo kSilence = {};

bool IsNearer(const Echo& a, const Echo& b) { return b.share == 0 || a.range_m < b.range_m; }

}  // namespace

void SonarModelOptions::Validate() const {
  if (crosstalk_min_db > crosstalk_max_db)
    throw UsageError("sonar_model.crosstalk_min_db must not be above crosstalk_max_db");
}

SonarSimulator::SonarSimulator(const SonarOptions& options, const SonarModelOptions& model,
                               const RayCaster& scene, std::uint64_t seed)
    : options_(options),
      model_(model),
      seed_(seed),
      caster_(options, model, scene),
      painter_(options, model, seed) {
  options.Validate();
  model.Validate();
}

std::vector<BeamEchoes> SonarSimulator::Ping(Time time, const Pose3& X_WB) const {
  return caster_.Cast(X_WB * SonarPose(options_, TiltAt(options_, time)));
}

SonarReturns SonarSimulator::Returns(Time time, std::int64_t sequence, const Pose3& X_WB) const {
  Random random(seed_, "sonar", sequence);
  std::vector<Echo> heard;
  for (const BeamEchoes& echoes : Ping(time, X_WB)) heard.push_back(Hear(echoes, random));
  SonarReturns returns;
  returns.time = time;
  returns.sequence = sequence;
  returns.tilt_rad = TiltAt(options_, time);
  returns.min_range_m = options_.min_range_m;
  returns.max_range_m = options_.max_range_m;
  for (int beam = 0; beam < options_.beams; ++beam) {
    const Echo echo = WithCrosstalk(heard, beam, random);
    const double strength = std::min(1.0, model_.echo_level * echo.share * DrawFading(random));
    returns.range_m.push_back(static_cast<float>(echo.range_m));
    returns.strength.push_back(static_cast<float>(strength));
  }
  return returns;
}

SonarFrame SonarSimulator::Frame(Time time, std::int64_t sequence, const Pose3& X_WB) const {
  Random random(seed_, "sonar", sequence);
  return {.time = time,
          .sequence = sequence,
          .tilt_rad = TiltAt(options_, time),
          .min_range_m = options_.min_range_m,
          .max_range_m = options_.max_range_m,
          .beams = options_.beams,
          .bins = model_.frame_bins,
          .samples = painter_.Paint(Ping(time, X_WB), random)};
}

bool SonarSimulator::InWindow(double range_m) const {
  return range_m >= options_.min_range_m && range_m <= options_.max_range_m;
}

/// The nearest surface that fills enough of the beam, most of the time.
Echo SonarSimulator::Detect(const BeamEchoes& echoes, Random& random) const {
  for (const Echo& echo : echoes) {
    const double sure = std::min(1.0, echo.share / model_.enough_echo);
    if (random.Chance(sure * (1 - model_.miss_probability)) && InWindow(echo.range_m)) return echo;
  }
  return kSilence;
}

/// What a beam would say without the others.
Echo SonarSimulator::Hear(const BeamEchoes& echoes, Random& random) const {
  Echo heard = Detect(echoes, random);
  heard.range_m += random.Gaussian(model_.range_noise_m);
  if (random.Chance(model_.double_bounce_probability) && !echoes.empty()) {
    heard = {2 * echoes.front().range_m,
             echoes.front().share * Attenuation(model_.double_bounce_db)};
  }
  if (heard.share == 0 || !InWindow(heard.range_m)) heard = kSilence;
  const Echo nothing{random.Uniform(options_.min_range_m, options_.max_range_m),
                     random.Uniform(0.3, 1)};
  if (random.Chance(model_.false_return_probability) && IsNearer(nothing, heard)) return nothing;
  return heard;
}

/// Now and then the echo of a beam that fires with this one comes first.
Echo SonarSimulator::WithCrosstalk(const std::vector<Echo>& heard, int beam, Random& random) const {
  const int side = random.Chance(0.5) ? 1 : -1;
  const double db = random.Uniform(model_.crosstalk_min_db, model_.crosstalk_max_db);
  const int other = beam + side * model_.crosstalk_period_beams;
  const bool talks = random.Chance(model_.crosstalk_probability) && other >= 0 &&
                     other < static_cast<int>(heard.size()) && heard[other].share > 0;
  if (!talks || !IsNearer(heard[other], heard[beam])) return heard[beam];
  return {heard[other].range_m, heard[other].share * Attenuation(db)};
}

}  // namespace vog
