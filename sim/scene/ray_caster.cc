#include "sim/scene/ray_caster.h"

#include <embree3/rtcore.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "lib/base/errors.h"

namespace vog {
namespace {

constexpr int kInsideDirections = 32;

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

/// Directions spread evenly over the sphere, on a Fibonacci spiral. None lies in a coordinate
/// plane, where generated meshes have their edges.
std::array<Vec3, kInsideDirections> SpreadDirections() {
  constexpr double kGolden = std::numbers::phi - 1;
  std::array<Vec3, kInsideDirections> directions;
  for (int i = 0; i < kInsideDirections; ++i) {
    const double z = 1 - (2 * i + 1.0) / kInsideDirections;
    const double angle = 2 * std::numbers::pi * kGolden * i + 0.1234;
    directions[i] = {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle),
                     z};
  }
  return directions;
}

/// How often a ray leaves surfaces minus how often it enters them.
struct CrossingCounter {
  RTCIntersectContext context;  // First, because Embree hands back its address.
  int winding = 0;

  CrossingCounter() {
    rtcInitIntersectContext(&context);
    context.filter = &Count;
  }

  static void Count(const RTCFilterFunctionNArguments* arguments) {
    const unsigned n = arguments->N;
    for (unsigned i = 0; i < n; ++i) {
      if (arguments->valid[i] == 0) continue;
      const float along = RTCRayN_dir_x(arguments->ray, n, i) * RTCHitN_Ng_x(arguments->hit, n, i) +
                          RTCRayN_dir_y(arguments->ray, n, i) * RTCHitN_Ng_y(arguments->hit, n, i) +
                          RTCRayN_dir_z(arguments->ray, n, i) * RTCHitN_Ng_z(arguments->hit, n, i);
      reinterpret_cast<CrossingCounter*>(arguments->context)->winding += along > 0 ? 1 : -1;
      arguments->valid[i] = 0;  // On to the next surface.
    }
  }
};

RTCRay MakeRay(const Vec3& origin, const Vec3& direction, double near_m, double far_m) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(near_m);
  ray.tfar = static_cast<float>(far_m);
  ray.mask = ~0u;
  return ray;
}

}  // namespace

struct RayCaster::Impl {
  // One thread builds: more would hardly be faster, and Embree's pool would outlive the call.
  Owned<RTCDevice> device{rtcNewDevice("threads=1")};
  Owned<RTCScene> scene;
  Vec3 origin_W = Vec3::Zero();  // Of Embree's coordinates, which are single precision.
  std::vector<Vec3> normals_W;

  explicit Impl(const TriangleMesh& mesh) {
    if (!device) throw SystemError("Embree cannot start on this machine");
    if (!mesh.vertices.empty()) origin_W = mesh.Bounds().center();
    scene.reset(rtcNewScene(device.get()));
    rtcSetSceneFlags(
        scene.get(),
        static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
    if (!mesh.triangles.empty()) AttachMesh(mesh);
    rtcCommitScene(scene.get());
    if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE)
      throw SystemError("Embree cannot build the scene: out of memory?");
  }

  void AttachMesh(const TriangleMesh& mesh) {
    const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.vertices.size()));
    auto* const indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices == nullptr || indices == nullptr)
      throw SystemError("Embree cannot build the scene: out of memory?");
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      Eigen::Map<Eigen::Vector3f>(vertices + 3 * i) = (mesh.vertices[i] - origin_W).cast<float>();
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      std::copy(t.begin(), t.end(), indices + 3 * i);
      const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
      normals_W.push_back((b - a).cross(c - a).normalized());
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
    rtcReleaseGeometry(geometry);
  }
};

RayCaster::RayCaster(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
RayCaster::~RayCaster() = default;

std::optional<RayHit> RayCaster::Cast(const Vec3& origin_W, const Vec3& direction_W,
                                      double max_range_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = MakeRay(origin_W - impl_->origin_W, direction_W, 0, max_range_m);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return RayHit{query.ray.tfar, impl_->normals_W[query.hit.primID], query.hit.primID};
}

bool RayCaster::Occluded(const Vec3& from_W, const Vec3& to_W) const {
  constexpr double kEnd_m = 1e-3;
  const double distance_m = (to_W - from_W).norm();
  if (distance_m <= 2 * kEnd_m) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray =
      MakeRay(from_W - impl_->origin_W, (to_W - from_W) / distance_m, kEnd_m, distance_m - kEnd_m);
  rtcOccluded1(impl_->scene.get(), &context, &ray);
  return ray.tfar < 0;
}

bool RayCaster::Inside(const Vec3& p_W) const {
  static const auto kDirections = SpreadDirections();
  CrossingCounter counter;
  for (const Vec3& direction : kDirections) {
    RTCRay ray =
        MakeRay(p_W - impl_->origin_W, direction, 0, std::numeric_limits<float>::infinity());
    rtcOccluded1(impl_->scene.get(), &counter.context, &ray);
  }
  return std::abs(counter.winding) > kInsideDirections / 2;
}

}  // namespace vog
