#include "lib/collision/mesh_clearance.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>

namespace vog {

struct MeshClearance::Models {
  fcl::BVHModel<fcl::OBBRSSd> mesh;
  fcl::BVHModel<fcl::OBBRSSd> hull;  // As triangles: FCL measures mesh against mesh exactly.
  fcl::Boxd solid_hull;              // To touch also what lies wholly inside.
};

namespace {

void Fill(fcl::BVHModel<fcl::OBBRSSd>& model, const TriangleMesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model.beginModel();
  model.addSubModel(mesh.vertices, triangles);
  model.endModel();
}

TriangleMesh BoxMesh(const Vec3& size_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.push_back(0.5 * size_m.cwiseProduct(Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1,
                                                           corner & 4 ? 1 : -1)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace

MeshClearance::MeshClearance(const TriangleMesh& mesh_W, const Vec3& hull_size_m)
    : models_(std::make_unique<Models>()) {
  models_->solid_hull = fcl::Boxd(hull_size_m);
  Fill(models_->mesh, mesh_W);
  Fill(models_->hull, BoxMesh(hull_size_m));
}

MeshClearance::~MeshClearance() = default;

bool MeshClearance::Collides(const Pose3& X_WB) const {
  fcl::CollisionResultd result;
  return fcl::collide<double>(&models_->mesh, Pose3::Identity(), &models_->solid_hull, X_WB,
                              fcl::CollisionRequestd(), result) > 0;
}

double MeshClearance::DistanceAt(const Pose3& X_WB) const {
  if (Collides(X_WB)) return 0;
  fcl::DistanceResultd result;
  return std::max(0.0, fcl::distance<double>(&models_->mesh, Pose3::Identity(), &models_->hull,
                                             X_WB, fcl::DistanceRequestd(), result));
}

}  // namespace vog
