#include "tools/mission/mesh_mission.h"

#include <cmath>
#include <optional>

#include "lib/base/files.h"
#include "lib/planner/planner_options.h"
#include "lib/scan/sonar.h"
#include "sim/scene/mesh_file.h"
#include "sim/scene/overlap.h"
#include "sim/scene/ray_caster.h"
#include "sim/scene/scene_options.h"

namespace vog {
namespace {

constexpr double kAround_m = 3;
// The start keeps this far inside the box's corner, so that the vehicle may move all ways.
constexpr double kInset_m = 1;

/// The first corner of `box_W` where the hull touches nothing.
std::optional<Vec3> FirstFreeCorner(const TriangleMesh& mesh_W, const Eigen::AlignedBox3d& box_W,
                                    const Vec3& hull_size_m) {
  const RayCaster scene(mesh_W);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 corner_W = box_W.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    const Vec3 inward = (box_W.center() - corner_W).cwiseSign() * kInset_m;
    const Vec3 p_W = corner_W + inward;
    if (!scene.Inside(p_W) && !BoxTouches(mesh_W, MakePose(p_W), hull_size_m)) return p_W;
  }
  return std::nullopt;
}

}  // namespace

void UseMesh(const std::filesystem::path& mesh, Config& config) {
  const double scale = config.Read<SceneOptions>("scene").mesh_scale;
  const TriangleMesh mesh_W = LoadMesh(mesh, scale);
  const Eigen::AlignedBox3d bounds_W = mesh_W.Bounds();
  const Vec3 around = Vec3::Constant(kAround_m);
  const Eigen::AlignedBox3d box_W(bounds_W.min() - around, bounds_W.max() + around);
  const auto start_W =
      FirstFreeCorner(mesh_W, box_W, config.Read<PlannerOptions>("planner").hull_size_m);
  if (!start_W)
    throw UsageError(mesh.string() +
                     ": the vehicle fits into no corner around it; set "
                     "simulation.start_position_m");
  const Vec3 towards = bounds_W.center() - *start_W;
  config.Set("scene.kind='mesh'");
  config.Set("scene.mesh='" + std::filesystem::absolute(mesh).string() + "'");
  config.Set("exploration.min_m=" + ToToml(box_W.min()));
  config.Set("exploration.max_m=" + ToToml(box_W.max()));
  config.Set("simulation.start_position_m=" + ToToml(*start_W));
  config.Set("simulation.start_yaw_deg=" +
             ToText(std::round(ToDegrees(std::atan2(towards.y(), towards.x())))));
}

}  // namespace vog
