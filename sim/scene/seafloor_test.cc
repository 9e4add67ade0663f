#include "sim/scene/seafloor.h"

#include <gtest/gtest.h>

#include <set>

#include "sim/scene/mesh_testing.h"
#include "sim/scene/seabed.h"

namespace vog {
namespace {

constexpr std::size_t kThings = 7 + 3 + 2;

std::vector<Vec3> VerticesOf(const TriangleMesh& part) {
  std::set<std::uint32_t> numbers;
  for (const auto& t : part.triangles) numbers.insert(t.begin(), t.end());
  std::vector<Vec3> vertices;
  for (const std::uint32_t number : numbers) vertices.push_back(part.vertices[number]);
  return vertices;
}

/// The corners of each thing on the floor.
std::vector<std::vector<Vec3>> ThingsOf(const TriangleMesh& mesh, const SeafloorOptions& options) {
  std::vector<std::vector<Vec3>> things;
  for (const TriangleMesh& part : PartsOf(mesh)) {
    std::vector<Vec3> vertices = VerticesOf(part);
    Eigen::AlignedBox3d bounds;
    for (const Vec3& vertex : vertices) bounds.extend(vertex);
    if (bounds.sizes().x() < 0.9 * options.length_m) things.push_back(std::move(vertices));
  }
  return things;
}

double LevelDistance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double least_m = 1e9;
  for (const Vec3& p : a)
    for (const Vec3& q : b) least_m = std::min(least_m, (p - q).head<2>().norm());
  return least_m;
}

TEST(SeafloorTest, PartsAreClosedShellsThatPointOutward) {
  for (const std::int64_t seed : {1, 2, 3})
    ExpectClosedParts(GenerateSeafloor({}, seed), 1 + kThings);
}

TEST(SeafloorTest, ThereIsRoomForEverythingWhateverTheSeed) {
  for (std::int64_t seed = 0; seed < 30; ++seed)
    EXPECT_NO_THROW(GenerateSeafloor({}, seed)) << seed;
}

TEST(SeafloorTest, TrianglesAreFewSmallAndNotDegenerate) {
  ExpectGoodTriangles(GenerateSeafloor({}, 1), SeafloorOptions{}.max_edge_m);
}

TEST(SeafloorTest, ThingsLieInTheMiddleApartFromEachOther) {
  const SeafloorOptions options;
  const auto things = ThingsOf(GenerateSeafloor(options, 1), options);
  ASSERT_EQ(things.size(), kThings);
  for (std::size_t i = 0; i < things.size(); ++i) {
    for (const Vec3& p : things[i]) {
      // Boxes are tilted, which may move their corners a bit outward.
      ASSERT_LT(std::abs(p.x()), 0.5 * options.clutter_length_m + 0.2);
      ASSERT_LT(std::abs(p.y()), 0.5 * options.clutter_breadth_m + 0.2);
    }
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(LevelDistance(things[i], things[j]), 0);
  }
}

TEST(SeafloorTest, ThingsAreHalfSunk) {
  const SeafloorOptions options;
  const Seabed bed(0, options.relief_m, options.wavelength_m, 1);
  for (const auto& thing : ThingsOf(GenerateSeafloor(options, 1), options)) {
    int above = 0, below = 0;
    for (const Vec3& p : thing) (p.z() > bed.HeightAt(p.x(), p.y()) ? above : below) += 1;
    EXPECT_GT(above, 0);
    EXPECT_GT(below, 0);
  }
}

TEST(SeafloorTest, HasAsManyThingsAsAskedFor) {
  SeafloorOptions options;
  options.boulders = options.boxes = 0;
  options.pipes = 1;
  ExpectClosedParts(GenerateSeafloor(options, 1), 2);
  options.pipes = 0;
  ExpectClosedParts(GenerateSeafloor(options, 1), 1);
}

TEST(SeafloorTest, RefusesWhatDoesNotFit) {
  SeafloorOptions options;
  options.boulders = 200;
  try {
    GenerateSeafloor(options, 1);
    ADD_FAILURE() << "200 boulders on 77 square metres";
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("scene.seafloor.boulders"), std::string::npos);
  }
  options = {};
  options.clutter_length_m = 30;
  EXPECT_THROW(GenerateSeafloor(options, 1), UsageError);
  options = {};
  options.pipe_diameter_m = 4;
  EXPECT_THROW(GenerateSeafloor(options, 1), UsageError);
}

}  // namespace
}  // namespace vog
