#include "sim/scene/seabed.h"

#include <gtest/gtest.h>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/ray_caster.h"

namespace vog {
namespace {

const Eigen::AlignedBox2d kArea(Eigen::Vector2d(-4, -3), Eigen::Vector2d(6, 2));

TEST(SeabedTest, SlabIsOneClosedShellOverTheArea) {
  const TriangleMesh slab = Seabed(-2, 0.4, 5, 1).Slab(kArea, 0.3);
  ExpectClosedParts(slab, 1);
  EXPECT_EQ(EulerNumber(slab), 2);
  const Eigen::AlignedBox3d bounds = slab.Bounds();
  EXPECT_TRUE(bounds.min().isApprox(Vec3(-4, -3, -3.4), 1e-9)) << bounds.min().transpose();
  EXPECT_TRUE(bounds.max().head<2>().isApprox(kArea.max(), 1e-9));
}

TEST(SeabedTest, SurfaceIsWhereItSays) {
  const Seabed bed(-2, 0.4, 5, 1);
  const RayCaster caster(bed.Slab(kArea, 0.3));
  for (double x = -3.9; x < 6; x += 0.37)
    for (double y = -2.9; y < 2; y += 0.31) {
      const auto hit = caster.Cast({x, y, 1}, -Vec3::UnitZ(), 10);
      ASSERT_TRUE(hit);
      ASSERT_NEAR(1 - hit->range_m, bed.HeightAt(x, y), 0.02);
      ASSERT_GT(hit->normal_W.z(), 0.5);
    }
  EXPECT_TRUE(caster.Inside({1, 0, -2.8}));
  EXPECT_FALSE(caster.Inside({1, 0, -1.5}));
}

TEST(SeabedTest, WithoutReliefItIsFlat) {
  const TriangleMesh slab = Seabed(1, 0, 5, 1).Slab(kArea, 1);
  EXPECT_NEAR(SignedVolume(slab), 10 * 5 * 1, 1e-9);
}

TEST(SeabedTest, AreaIsUnderTheStructure) {
  const Eigen::AlignedBox2d area = AreaAround(Box(MakePose({1, 2, 3}), {2, 4, 6}), 0.5);
  EXPECT_TRUE(area.min().isApprox(Eigen::Vector2d(-0.5, -0.5)));
  EXPECT_TRUE(area.max().isApprox(Eigen::Vector2d(2.5, 4.5)));
}

}  // namespace
}  // namespace vog
