#include "lib/planner/panorama.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"
#include "lib/planner/chamber_testing.h"
#include "lib/planner/view_gain.h"

namespace vog {
namespace {

double One(const VoxelKey&) { return 1; }

SonarOptions CentredSonar() {
  SonarOptions sonar = WideSonar();
  sonar.mount_m = {0, 0, 0};
  return sonar;
}

TEST(PanoramaTest, EstimatesWhatEachViewSees) {
  GridMap map = Chamber();
  Random random(1, "unknown");
  for (int i = 0; i < 12; ++i) {
    const VoxelKey at = {random.Index(28) - 14, random.Index(20) - 10, random.Index(10) - 5};
    map.Fill({{at.x - 2, at.y - 2, at.z - 2}, {at.x + 1, at.y + 1, at.z + 1}}, kUnknownLogOdds);
  }
  const Panorama panorama(CentredSonar(), 4, ChamberBox());
  const ViewGain view(CentredSonar(), 4, 1.5, ChamberBox());
  double estimated = 0, seen = 0;
  for (const Vec3& p_W : {Vec3(-1.5, -0.5, 0.1), Vec3(0.2, 0.3, -0.2), Vec3(1.6, 1.7, 0.3)}) {
    const GainByHeading gains = panorama.Look(map, p_W, One);
    for (int heading = 0; heading < kHeadings; ++heading) {
      const int visible = view.Visible(map, {p_W, YawOfHeading(heading)});
      EXPECT_NEAR(gains[static_cast<std::size_t>(heading)], visible, 60 + 0.35 * visible)
          << heading;
      estimated += gains[static_cast<std::size_t>(heading)];
      seen += visible;
    }
  }
  EXPECT_GT(seen, 2000);
  EXPECT_NEAR(estimated / seen, 1, 0.15);
}

TEST(PanoramaTest, FacesWhatIsUnknown) {
  GridMap map = Chamber();
  map.Fill({{-12, 6, -2}, {-9, 9, 1}}, kUnknownLogOdds);
  const Vec3 p_W(-1.5, -0.5, 0);
  const GainByHeading gains = Panorama(CentredSonar(), 4, ChamberBox()).Look(map, p_W, One);
  const Vec3 to = map.grid().CenterOf({-10, 8, 0}) - p_W;
  const auto best = std::max_element(gains.begin(), gains.end()) - gains.begin();
  EXPECT_LE(std::abs(WrapAngle(YawOfHeading(static_cast<int>(best)) - std::atan2(to.y(), to.x()))),
            0.4);
  const int behind = (static_cast<int>(best) + kHeadings / 2) % kHeadings;
  EXPECT_EQ(gains[static_cast<std::size_t>(behind)], 0);
}

TEST(PanoramaTest, WeighsVoxels) {
  const GridMap map(kChamberVoxel_m);
  const Panorama panorama(CentredSonar(), 4, ChamberBox());
  const GainByHeading once = panorama.Look(map, Vec3::Zero(), One);
  const GainByHeading weighted =
      panorama.Look(map, Vec3::Zero(), [](const VoxelKey& key) { return key.x >= 0 ? 3 : 0; });
  EXPECT_NEAR(weighted[0], 3 * once[0], 1e-3 * once[0]);
  EXPECT_EQ(weighted[8], 0);
}

}  // namespace
}  // namespace vog
