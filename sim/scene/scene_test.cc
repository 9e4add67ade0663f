#include "sim/scene/scene.h"

#include <gtest/gtest.h>

#include "sim/scene/mesh_file.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

TriangleMesh Make(const char* text, const std::filesystem::path& directory = ".") {
  const Config config = Config::Parse(text, "scene.toml");
  return MakeScene(config.Read<SceneOptions>("scene"),
                   config.Read<PropellerOptions>("scene.propeller"),
                   config.Read<TankOptions>("scene.tank"), directory);
}

TEST(SceneTest, GeneratesWhatTheOptionsSay) {
  EXPECT_NEAR(Make("").Bounds().sizes().x(), 7, 0.1);
  EXPECT_NEAR(Make("scene.kind = 'tank'\nscene.tank.diameter_m = 5").Bounds().sizes().x(), 5, 0.01);
  EXPECT_LT(Make("[scene.propeller]\nblades = 3").triangles.size(), Make("").triangles.size());
}

TEST(SceneTest, LooksForTheMeshBesideTheConfiguration) {
  const std::filesystem::path folder = testing::TempDir();
  SaveMesh(Box(Pose3::Identity(), {1, 2, 3}), folder / "scene_test_box.ply");
  const char* text = "[scene]\nkind = 'mesh'\nmesh = 'scene_test_box.ply'\nmesh_scale = 2";
  EXPECT_TRUE(Make(text, folder).Bounds().sizes().isApprox(Vec3(2, 4, 6), 1e-6));
  EXPECT_THROW(Make(text, folder / "elsewhere"), UsageError);
}

TEST(SceneTest, AcceptsAnAbsolutePath) {
  const std::filesystem::path path =
      std::filesystem::absolute(std::filesystem::path(testing::TempDir()) / "scene_test_abs.ply");
  SaveMesh(Box(Pose3::Identity(), {1, 1, 1}), path);
  SceneOptions options;
  options.kind = SceneKind::kMesh;
  options.mesh = path.string();
  EXPECT_EQ(MakeScene(options, {}, {}, "/nowhere").triangles.size(), 12u);
}

TEST(SceneTest, AMeshNeedsAFile) { EXPECT_THROW(Make("scene.kind = 'mesh'"), UsageError); }

}  // namespace
}  // namespace vog
