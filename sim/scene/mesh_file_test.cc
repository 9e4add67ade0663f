#include "sim/scene/mesh_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "sim/scene/mesh_testing.h"
#include "sim/scene/propeller.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

class MeshFileTest : public testing::Test {
 protected:
  MeshFileTest() { std::filesystem::create_directories(folder_); }
  ~MeshFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) const {
    WriteFileAtomically(folder_ / name, text);
    return folder_ / name;
  }

  static std::string ErrorOf(const std::filesystem::path& path) {
    try {
      LoadMesh(path, 1);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) /
                                  testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(MeshFileTest, PlyReadsBackWhatWasWritten) {
  const TriangleMesh mesh = GeneratePropeller({});
  SaveMesh(mesh, folder_ / "propeller.ply");
  const TriangleMesh read = LoadMesh(folder_ / "propeller.ply", 1);
  EXPECT_EQ(read.triangles.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 wrote = mesh.vertices[mesh.triangles[i][k]];
      ASSERT_LT((read.vertices[read.triangles[i][k]] - wrote).norm(), 1e-6) << i;
    }
  }
  EXPECT_NEAR(SignedVolume(read), SignedVolume(mesh), 1e-4);
}

TEST_F(MeshFileTest, ReadsObjWithQuadrilateralsAndScale) {
  const auto path = Write("box.obj",
                          "v 0 0 0\nv 100 0 0\nv 100 200 0\nv 0 200 0\n"
                          "v 0 0 300\nv 100 0 300\nv 100 200 300\nv 0 200 300\n"
                          "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const TriangleMesh mesh = LoadMesh(path, 0.01);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), 6, 1e-6);
}

TEST_F(MeshFileTest, JoinsTheCornersOfStl) {
  const auto path = Write("tetrahedron.stl",
                          "solid t\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\n"
                          "vertex 1 0 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                          "vertex 0 0 1\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n"
                          "vertex 0 1 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\n"
                          "vertex 0 0 1\nendloop\nendfacet\n"
                          "endsolid t\n");
  const TriangleMesh mesh = LoadMesh(path, 1);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6, 1e-6);
}

TEST_F(MeshFileTest, LeavesOutLinesPointsAndTrianglesWithoutArea) {
  const auto path = Write("mixed.obj",
                          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\n"
                          "f 1 2 3\nf 1 2 4\nf 1 1 2\nl 1 3\np 2\n");
  EXPECT_EQ(LoadMesh(path, 1).triangles.size(), 1u);
}

// A triangle of one unit, 0.5 m each, in a node that lifts it by two units; z is up.
std::string Dae(const std::string& up_axis, const std::string& lift) {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.5"/><up_axis>)" +
         up_axis + R"(</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node>
<translate>)" +
         lift + R"(</translate><instance_geometry url="#g"/>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST_F(MeshFileTest, AppliesNodesUnitAndUpAxisOfDae) {
  const TriangleMesh z_up = LoadMesh(Write("z.dae", Dae("Z_UP", "0 0 2")), 1);
  ASSERT_EQ(z_up.triangles.size(), 1u);
  EXPECT_TRUE(z_up.Bounds().min().isApprox(Vec3(0, 0, 1), 1e-5)) << z_up.Bounds().min().transpose();
  EXPECT_TRUE(z_up.Bounds().max().isApprox(Vec3(0.5, 0.5, 1), 1e-5));

  const TriangleMesh y_up = LoadMesh(Write("y.dae", Dae("Y_UP", "0 2 0")), 1);
  ASSERT_EQ(y_up.triangles.size(), 1u);
  EXPECT_TRUE(y_up.Bounds().min().isApprox(Vec3(0, 0, 1), 1e-5)) << y_up.Bounds().min().transpose();
  EXPECT_TRUE(y_up.Bounds().max().isApprox(Vec3(0.5, 0, 1.5), 1e-5));
}

TEST_F(MeshFileTest, SaysInOneLineWhatIsWrong) {
  EXPECT_EQ(ErrorOf(folder_ / "none.stl"), (folder_ / "none.stl").string() + ": no such mesh file");
  EXPECT_EQ(ErrorOf(folder_), folder_.string() + ": no such mesh file");
  for (const char* name : {"text.stl", "text.ply", "text.obj", "text.dae", "text.toml"}) {
    const std::string error = ErrorOf(Write(name, "this is not a mesh\n"));
    EXPECT_TRUE(error.starts_with((folder_ / name).string() + ": ")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_NE(ErrorOf(Write("points.ply",
                          "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
                          "property float y\nproperty float z\nend_header\n0 0 0\n1 1 1\n"))
                .find("points.ply: "),
            std::string::npos);
  EXPECT_EQ(ErrorOf(Write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")),
            (folder_ / "flat.obj").string() + ": the mesh has no triangles");
}

TEST_F(MeshFileTest, ReadsRealMeshes) {
  const std::filesystem::path meshes = VOG_SOURCE_DIR "/../shared/data/meshes";
  if (!std::filesystem::is_directory(meshes)) GTEST_SKIP() << meshes << " is absent";
  const TriangleMesh tank = LoadMesh(meshes / "nps_cylinder_tank_7m.stl", 1);
  EXPECT_GT(tank.triangles.size(), 100u);
  EXPECT_NEAR(tank.Bounds().sizes().maxCoeff(), 7, 1);
  const TriangleMesh node = LoadMesh(meshes / "mbari_mars_node_7m.stl", 0.5);
  EXPECT_NEAR(node.Bounds().sizes().maxCoeff(), 3.5, 0.5);
}

}  // namespace
}  // namespace vog
