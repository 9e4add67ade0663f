#include "sim/scene/mesh_file.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <utility>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

/// Collects triangles, giving equal corners one number.
class MeshBuilder {
 public:
  void Add(const std::array<Vec3, 3>& corners) {
    const double twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    if (!(twice_area > 0)) return;  // Degenerate, or not a number.
    std::array<std::uint32_t, 3> triangle;
    std::transform(corners.begin(), corners.end(), triangle.begin(),
                   [&](const Vec3& corner) { return NumberOf(corner); });
    mesh_.triangles.push_back(triangle);
  }

  TriangleMesh Take() { return std::move(mesh_); }

 private:
  std::uint32_t NumberOf(const Vec3& p) {
    const auto [place, is_new] = numbers_.try_emplace({p.x(), p.y(), p.z()}, mesh_.vertices.size());
    if (is_new) mesh_.vertices.push_back(p);
    return place->second;
  }

  using Place = std::array<double, 3>;
  struct HashOf {
    std::size_t operator()(const Place& place) const {
      std::size_t hash = 0;
      for (const double coordinate : place)
        hash = 0x9e3779b97f4a7c15u * (hash ^ std::hash<double>()(coordinate));
      return hash ^ (hash >> 32);
    }
  };

  TriangleMesh mesh_;
  std::unordered_map<Place, std::uint32_t, HashOf> numbers_;
};

Eigen::Affine3d ToEigen(const aiMatrix4x4& m) {
  Eigen::Affine3d X;
  X.matrix() << m.a1, m.a2, m.a3, m.a4,  //
      m.b1, m.b2, m.b3, m.b4,            //
      m.c1, m.c2, m.c3, m.c4,            //
      0, 0, 0, 1;
  return X;
}

void AddMesh(const aiMesh& mesh, const Eigen::Affine3d& X, MeshBuilder& builder) {
  const bool mirrored = X.linear().determinant() < 0;
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;
    std::array<Vec3, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const aiVector3D& v = mesh.mVertices[face.mIndices[k]];
      corners[k] = X * Vec3(v.x, v.y, v.z);
    }
    if (mirrored) std::swap(corners[1], corners[2]);
    builder.Add(corners);
  }
}

void AddNode(const aiScene& scene, const aiNode& node, const Eigen::Affine3d& X_parent,
             MeshBuilder& builder) {
  const Eigen::Affine3d X = X_parent * ToEigen(node.mTransformation);
  for (unsigned i = 0; i < node.mNumMeshes; ++i)
    AddMesh(*scene.mMeshes[node.mMeshes[i]], X, builder);
  for (unsigned i = 0; i < node.mNumChildren; ++i) AddNode(scene, *node.mChildren[i], X, builder);
}

/// assimp turns every DAE file so that y is up.
Eigen::Affine3d UpAxisCorrection(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".dae") return Eigen::Affine3d::Identity();
  return Eigen::Affine3d(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitX()));
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

template <class T>
void AppendBytes(const T& value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TriangleMesh LoadMesh(const std::filesystem::path& path, double scale) {
  if (!std::filesystem::is_regular_file(path))
    throw UsageError(path.string() + ": no such mesh file");
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_SortByPType);
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw UsageError(path.string() + ": not a mesh: " + FirstLine(importer.GetErrorString()));
  MeshBuilder builder;
  AddNode(*scene, *scene->mRootNode, Eigen::Scaling(scale) * UpAxisCorrection(path), builder);
  TriangleMesh mesh = builder.Take();
  if (mesh.triangles.empty()) throw UsageError(path.string() + ": the mesh has no triangles");
  return mesh;
}

void SaveMesh(const TriangleMesh& mesh, const std::filesystem::path& path) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(mesh.triangles.size()) +
                      "\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const Vec3& vertex : mesh.vertices) {
    const Eigen::Vector3f single = vertex.cast<float>();
    for (const float coordinate : single) AppendBytes(coordinate, bytes);
  }
  for (const auto& triangle : mesh.triangles) {
    AppendBytes(std::uint8_t{3}, bytes);
    for (const std::uint32_t corner : triangle) AppendBytes(corner, bytes);
  }
  WriteFileAtomically(path, bytes);
}

}  // namespace vog
