#include "procs/map_service/map_answers.h"

#include <algorithm>
#include <cmath>

#include "lib/occupancy/ray_answers.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/merged_grid.h"

namespace vog {
namespace {

// A reply should fit into a few hundred chunks.
constexpr std::size_t kMaxAnswers = 2'000'000;
constexpr double kMaxRange_m = 1e4;

void AddAnswer(const Vec3& center_W, float log_odds, map_reply_t& reply) {
  reply.center_W_m.push_back({static_cast<float>(center_W.x()), static_cast<float>(center_W.y()),
                              static_cast<float>(center_W.z())});
  reply.log_odds.push_back(log_odds);
  ++reply.count;
}

void AnswerPoints(const VogMap& map, const map_request_t& request, map_reply_t& reply) {
  std::vector<Vec3> points_W;
  for (const auto& point : request.point_W_m) points_W.emplace_back(point[0], point[1], point[2]);
  const bool is_direct = request.method == "direct";
  if (!is_direct) {
    for (Vec3& p : points_W) p = map.grid().CenterOf(map.grid().KeyOf(p));
  }
  std::vector<float> log_odds(points_W.size());
  map.LogOddsAt(points_W, log_odds);
  for (std::size_t i = 0; i < points_W.size(); ++i) AddAnswer(points_W[i], log_odds[i], reply);
}

void AnswerRay(const VogMap& map, const map_request_t& request, map_reply_t& reply) {
  const Vec3 origin_W = Eigen::Map<const Vec3>(request.origin_W_m);
  const Vec3 direction_W = Eigen::Map<const Vec3>(request.direction_W).normalized();
  const RayAnswers ray = request.method == "direct"
                             ? AnswersAtSteps(map, origin_W, direction_W, request.range_m)
                             : AnswersInVoxels(map, origin_W, direction_W, request.range_m);
  for (std::size_t i = 0; i < ray.points_W.size(); ++i)
    AddAnswer(ray.points_W[i], ray.log_odds[i], reply);
}

void AnswerBox(const VogMap& map, const map_request_t& request, map_reply_t& reply) {
  Eigen::AlignedBox3d bounds_W;
  for (const auto& corner : request.point_W_m)
    bounds_W.extend(Vec3(corner[0], corner[1], corner[2]));
  const VoxelBox box = VoxelsOf(map.grid(), bounds_W);
  std::vector<float> log_odds;
  map.LogOddsIn(box, log_odds);
  std::size_t i = 0;
  ForEachVoxel(box, [&](const VoxelKey& voxel) {
    AddAnswer(map.grid().CenterOf(voxel), log_odds[i++], reply);
  });
}

bool IsSmallBox(const VogMap& map, const map_request_t& request) {
  if (request.points != 2) return false;
  double voxels = 1;
  for (int axis = 0; axis < 3; ++axis)
    voxels *= std::abs(request.point_W_m[1][axis] - request.point_W_m[0][axis]) /
                  map.grid().voxel_size_m() +
              2;
  return voxels <= static_cast<double>(kMaxAnswers);
}

bool AllFinite(const map_request_t& request) {
  const auto finite = [](double number) { return std::isfinite(number) && std::abs(number) < 1e5; };
  return std::all_of(request.point_W_m.begin(), request.point_W_m.end(),
                     [&](const auto& p) { return std::all_of(p.begin(), p.end(), finite); }) &&
         std::all_of(std::begin(request.origin_W_m), std::end(request.origin_W_m), finite) &&
         std::all_of(std::begin(request.direction_W), std::end(request.direction_W), finite) &&
         finite(request.range_m);
}

}  // namespace

map_reply_t AnswerTo(const map_request_t& request, const VogMap& map) {
  map_reply_t reply{};
  reply.request_id = request.request_id;
  const bool has_method = request.kind == "points" || request.kind == "ray";
  if (!AllFinite(request)) {
    reply.error = "a number in the request is not finite or too large";
  } else if (has_method && request.method != "direct" && request.method != "cached") {
    reply.error = "method must be direct or cached";
  } else if (request.kind == "points") {
    if (request.point_W_m.size() > kMaxAnswers)
      reply.error = "at most 2000000 points";
    else
      AnswerPoints(map, request, reply);
  } else if (request.kind == "ray") {
    if (Eigen::Map<const Vec3>(request.direction_W).norm() < 1e-9)
      reply.error = "the ray has no direction";
    else if (request.range_m > kMaxRange_m)
      reply.error = "a ray is at most 10000 m long";
    else
      AnswerRay(map, request, reply);
  } else if (request.kind == "box") {
    if (!IsSmallBox(map, request))
      reply.error = "a box has two corners and at most 2000000 voxels";
    else
      AnswerBox(map, request, reply);
  } else if (request.kind == "snapshot") {
    const std::string bytes = ToOctreeBytes(MergedGrid(map));
    reply.octree.assign(bytes.begin(), bytes.end());
    reply.size = static_cast<int>(reply.octree.size());
  } else {
    reply.error = "kind must be one of submaps, poses, points, ray, box, snapshot";
  }
  return reply;
}

}  // namespace vog
