#include "tools/report/view.h"

#include <gtest/gtest.h>

#include <sstream>

namespace vog {
namespace {

TEST(StartViewTest, HasEqualAxes) {
  const PlotMargins margins{.left = 50, .right = 10, .top = 30, .bottom = 40};
  for (const Vec3& size : {Vec3(12, 7, 3), Vec3(1, 9, 2), Vec3(5, 5, 30)})
    for (const View& view : {kTopView, kSideView}) {
      const Plot dut = StartView(view, {Vec3::Zero(), size}, 540, PictureFormat::kSvg, margins);
      const double width = dut.width_px - margins.left - margins.right;
      const double height = dut.height_px - margins.top - margins.bottom;
      EXPECT_NEAR(height / width, view.UpOf(size) / view.RightOf(size), 0.03 * height / width);
      EXPECT_LE(dut.width_px, 541);
      EXPECT_LE(dut.height_px, 700);
    }
}

/// What an image shows: the shaded area [m^2] and the mean shade.
struct Shading {
  double area_m2 = 0, mean = 0;
};

Shading ShadingOf(const std::string& shadow) {
  std::istringstream lines(shadow);
  double right, up, first_right = 0, step_m = 0, sum = 0;
  std::string shade;
  int cells = 0, shaded = 0;
  for (; lines >> right >> up >> shade; ++cells) {
    if (cells == 0) first_right = right;
    if (cells == 1) step_m = right - first_right;
    if (shade == "NaN") continue;
    ++shaded;
    sum += std::stod(shade);
  }
  return {shaded * step_m * step_m, shaded > 0 ? sum / shaded : 0};
}

TEST(MeshShadowTest, CoversWhatTheMeshCovers) {
  const TriangleMesh triangle{{{0, 0, 0}, {4, 0, 1}, {0, 2, -1}}, {{0, 1, 2}}};
  const Shading dut = ShadingOf(MeshShadow(triangle, kTopView));
  EXPECT_NEAR(dut.area_m2, 4, 0.15);
  EXPECT_LT(dut.mean, 0.2);
}

TEST(MeshShadowTest, IsDarkerWhereMoreSurfaceLies) {
  const TriangleMesh wall{{{0, 0, 0}, {2, 0.05, 0}, {2, 0.05, 3}, {0, 0, 3}},
                          {{0, 1, 2}, {0, 2, 3}}};
  EXPECT_GT(ShadingOf(MeshShadow(wall, kTopView)).mean, 0.9);
  const Shading from_side = ShadingOf(MeshShadow(wall, kSideView));
  EXPECT_NEAR(from_side.area_m2, 6, 0.15);
  EXPECT_LT(from_side.mean, 0.2);
}

TEST(MeshShadowTest, OfNothingIsNothing) { EXPECT_EQ(MeshShadow({}, kTopView), ""); }

}  // namespace
}  // namespace vog
