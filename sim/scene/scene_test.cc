#include "sim/scene/scene.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "sim/scene/mesh_file.h"
#include "sim/scene/shapes.h"

namespace vog {
namespace {

TriangleMesh Make(const char* text, const std::filesystem::path& directory = ".") {
  SceneSettings settings = SceneSettings::From(Config::Parse(text, "scene.toml"));
  settings.directory = directory;
  return MakeScene(settings);
}

TEST(SceneTest, GeneratesWhatTheOptionsSay) {
  EXPECT_NEAR(Make("").Bounds().sizes().x(), 7, 0.1);
  EXPECT_NEAR(Make("scene.kind = 'tank'\nscene.tank.diameter_m = 5").Bounds().sizes().x(), 5, 0.01);
  EXPECT_LT(Make("[scene.propeller]\nblades = 3").triangles.size(), Make("").triangles.size());
}

TEST(SceneTest, EachKindIsAnotherStructure) {
  std::set<std::size_t> triangles;
  for (const auto& [kind, name] : SceneKindNames()) {
    if (kind == SceneKind::kMesh) continue;
    triangles.insert(Make(("scene.kind = '" + name + "'").c_str()).triangles.size());
  }
  EXPECT_EQ(triangles.size(), SceneKindNames().size() - 1);
}

TEST(SceneTest, ReadsTheTableOfEachKind) {
  EXPECT_NEAR(Make("scene.kind = 'mine'\nscene.mine.diameter_m = 2\nscene.mine.horns = 0")
                  .Bounds()
                  .max()
                  .z(),
              1, 0.01);
  for (const auto* text :
       {"[scene.pier]\nrow = 1", "[scene.wreck]\nlength = 1", "[scene.seafloor]\nboulder = 1",
        "[scene.mine]\nhorn = 1", "[scene.pier]\nrows = 0", "[scene.wreck]\nlist_deg = 100"})
    EXPECT_THROW(Make(text), UsageError) << text;
}

TEST(SceneTest, TheSeedIsThatOfTheScene) {
  for (const std::string kind : {"pier", "wreck", "seafloor"}) {
    const auto with = [&](const char* seed) {
      return Make(("[scene]\nkind = '" + kind + "'\nseed = " + seed).c_str());
    };
    EXPECT_EQ(with("3").vertices, with("3").vertices) << kind;
    EXPECT_NE(with("3").vertices, with("4").vertices) << kind;
  }
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
  SceneSettings settings;
  settings.scene.kind = SceneKind::kMesh;
  settings.scene.mesh = path.string();
  settings.directory = "/nowhere";
  EXPECT_EQ(MakeScene(settings).triangles.size(), 12u);
}

TEST(SceneTest, AMeshNeedsAFile) { EXPECT_THROW(Make("scene.kind = 'mesh'"), UsageError); }

}  // namespace
}  // namespace vog
