#include "lib/occupancy/ray_answers.h"

namespace vog {
namespace {

void StopAtFirstHit(const OccupancyMap& map, RayAnswers& answers) {
  for (std::size_t i = 0; i < answers.log_odds.size(); ++i) {
    if (!map.IsOccupied(answers.log_odds[i])) continue;
    answers.points_W.resize(i + 1);
    answers.log_odds.resize(i + 1);
    return;
  }
}

}  // namespace

RayAnswers AnswersInVoxels(const OccupancyMap& map, const Vec3& origin_W, const Vec3& direction_W,
                           double range_m) {
  std::vector<RayVoxel> ray;
  map.CastRay(origin_W, direction_W, range_m, ray);
  RayAnswers answers;
  for (const RayVoxel& voxel : ray) {
    answers.points_W.push_back(map.grid().CenterOf(voxel.key));
    answers.log_odds.push_back(voxel.log_odds);
  }
  return answers;
}

RayAnswers AnswersAtSteps(const OccupancyMap& map, const Vec3& origin_W, const Vec3& direction_W,
                          double range_m) {
  const double step_m = map.grid().voxel_size_m();
  RayAnswers answers;
  for (int k = 1; k * step_m <= range_m; ++k)
    answers.points_W.push_back(origin_W + k * step_m * direction_W);
  answers.log_odds.resize(answers.points_W.size());
  map.LogOddsAt(answers.points_W, answers.log_odds);
  StopAtFirstHit(map, answers);
  return answers;
}

}  // namespace vog
