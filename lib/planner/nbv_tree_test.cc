#include "lib/planner/nbv_tree.h"

#include <gtest/gtest.h>

#include "lib/planner/chamber_testing.h"
#include "lib/planner/view_gain.h"

namespace vog {
namespace {

class NbvTreeTest : public testing::Test {
 protected:
  /// The half of the chamber around the start is known.
  NbvTreeTest() : map_(kChamberVoxel_m) {
    const GridMap truth = Chamber();
    ForEachVoxel({{-18, -13, -7}, {2, 12, 6}},
                 [&](const VoxelKey& key) { map_.Set(key, truth.Get(key)); });
    options_.lambda_1_m = 0.3;
  }

  TreeContext Context() const { return ContextOn(map_); }
  TreeContext ContextOn(const GridMap& map) const {
    return {map, checker_, [&](const Waypoint& at) { return view_.Visible(map, at); }};
  }
  NbvTree Grown(int nodes, int seed = 1) const {
    NbvTree tree(options_, ChamberBox(), kRoot);
    Random random(static_cast<std::uint64_t>(seed), "tree");
    tree.GrowTo(Context(), nodes, random);
    return tree;
  }
  void ExpectSound(const NbvTree& tree) const {
    const CollisionChecker nearly = checker_.Scaled(0.8);
    for (std::size_t i = 1; i < tree.nodes().size(); ++i) {
      const TreeNode& node = tree.nodes()[i];
      ASSERT_GE(node.parent, 0);
      ASSERT_LT(node.parent, static_cast<int>(i));
      const TreeNode& parent = tree.nodes()[static_cast<std::size_t>(node.parent)];
      // Sampled anew, much more densely.
      for (int step = 0; step <= 50; ++step)
        EXPECT_TRUE(nearly.IsFree(map_, Interpolate(parent.at, node.at, step / 50.0))) << i;
      EXPECT_NEAR(node.edge_m, LengthOf(parent.at, node.at), 1e-12);
      EXPECT_NEAR(node.from_root_m, parent.from_root_m + node.edge_m, 1e-12);
      EXPECT_LE(node.edge_m, options_.max_edge_m + 1e-9);
      EXPECT_TRUE(ChamberBox().contains(node.at.position_W_m));
    }
  }

  static constexpr double kStart_m = -2;
  const Waypoint kRoot{{kStart_m, 0, 0}, 0.3};
  GridMap map_;
  PlannerOptions options_ = SmallPlanner();
  CollisionChecker checker_{options_.collision_rules()};
  ViewGain view_{WideSonar(), options_.range_m, options_.ray_step_deg, ChamberBox()};
};

TEST_F(NbvTreeTest, AllEdgesAreFree) {
  for (int seed = 0; seed < 5; ++seed) {
    const NbvTree tree = Grown(40, seed);
    EXPECT_EQ(tree.nodes().size(), 41u);
    ExpectSound(tree);
  }
}

TEST_F(NbvTreeTest, GainsAreThoseOfEquation7) {
  for (const Discount discount : {Discount::kEdge, Discount::kRoot}) {
    options_.discount = discount;
    const NbvTree tree = Grown(40);
    int best = 0;
    for (std::size_t i = 1; i < tree.nodes().size(); ++i) {
      const TreeNode& node = tree.nodes()[i];
      int visible = view_.Visible(map_, node.at);
      if (visible < options_.zero_gain_voxels) visible = 0;
      EXPECT_EQ(node.visible, visible);
      const double cost_m = discount == Discount::kEdge ? node.edge_m : node.from_root_m;
      EXPECT_NEAR(node.gain,
                  tree.nodes()[static_cast<std::size_t>(node.parent)].gain +
                      visible * std::exp(-0.3 * cost_m),
                  1e-9);
      if (node.gain > tree.nodes()[static_cast<std::size_t>(best)].gain) best = static_cast<int>(i);
    }
    EXPECT_EQ(tree.best(), best);
    EXPECT_GT(tree.nodes()[static_cast<std::size_t>(best)].gain, 0);
  }
}

TEST_F(NbvTreeTest, ThresholdMakesSmallViewsZero) {
  options_.zero_gain_voxels = 1000000;
  const NbvTree tree = Grown(20);
  EXPECT_EQ(tree.best(), 0);
  for (const TreeNode& node : tree.nodes()) EXPECT_EQ(node.gain, 0);
}

TEST_F(NbvTreeTest, GrowsOnFromWhereItWas) {
  NbvTree tree(options_, ChamberBox(), kRoot);
  Random random(1, "tree");
  tree.GrowTo(Context(), 10, random);
  EXPECT_EQ(tree.nodes().size(), 11u);
  const std::vector<TreeNode> before = tree.nodes();
  tree.GrowTo(Context(), 30, random);
  EXPECT_EQ(tree.nodes().size(), 31u);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(tree.nodes()[i].at.position_W_m, before[i].at.position_W_m);
}

TEST_F(NbvTreeTest, EndsWhereNoSampleFits) {
  const GridMap nothing_known(kChamberVoxel_m);
  NbvTree tree(options_, ChamberBox(), kRoot);
  Random random(1, "tree");
  tree.GrowTo(ContextOn(nothing_known), 15, random);
  EXPECT_EQ(tree.nodes().size(), 1u);
  EXPECT_EQ(tree.best(), 0);
}

TEST_F(NbvTreeTest, SamplesAreBoundedInAll) {
  options_.max_samples = 12;
  const NbvTree tree = Grown(100);
  EXPECT_LE(tree.nodes().size(), 13u);
}

TEST_F(NbvTreeTest, ABranchIsTakenAsFarAsItIsFree) {
  NbvTree tree(options_, ChamberBox(), kRoot);
  const std::vector<Waypoint> branch = {
      {{kStart_m, 1, 0}, 1}, {{kStart_m + 1, 1, 0}, 2}, {{3, 1, 0}, 0}, {{kStart_m, 0, 0}, 0}};
  tree.AddBranch(Context(), branch);  // The third leads into the unknown.
  ASSERT_EQ(tree.nodes().size(), 3u);
  EXPECT_EQ(tree.nodes()[1].parent, 0);
  EXPECT_EQ(tree.nodes()[2].parent, 1);
  EXPECT_EQ(tree.nodes()[2].at.yaw_rad, 2);
  ExpectSound(tree);
  const auto way = tree.BranchTo(2);
  ASSERT_EQ(way.size(), 3u);
  EXPECT_EQ(way[0].position_W_m, kRoot.position_W_m);
  EXPECT_EQ(way[2].position_W_m, branch[1].position_W_m);
}

TEST_F(NbvTreeTest, TurnsStayOnTheSpot) {
  NbvTree tree(options_, ChamberBox(), kRoot);
  tree.AddTurns(Context(), 8);
  ASSERT_EQ(tree.nodes().size(), 8u);
  for (std::size_t i = 1; i < 8; ++i) {
    EXPECT_EQ(tree.nodes()[i].at.position_W_m, kRoot.position_W_m);
    EXPECT_EQ(tree.nodes()[i].parent, 0);
    EXPECT_NEAR(std::remainder(tree.nodes()[i].at.yaw_rad - kRoot.yaw_rad -
                                   EIGEN_PI / 4 * static_cast<double>(i),
                               2 * EIGEN_PI),
                0, 1e-9);
  }
}

TEST_F(NbvTreeTest, GrowsTowardATarget) {
  const Waypoint target{{kStart_m + 1, -1.5, 0.3}, 0};
  NbvTree tree(options_, ChamberBox(), kRoot);
  Random random(2, "tree");
  const int node = tree.GrowToward(Context(), target, 40, random);
  EXPECT_LT(LengthOf(tree.nodes()[static_cast<std::size_t>(node)].at, target), 0.11);
  ExpectSound(tree);
  // One that cannot be reached: as near as may be.
  NbvTree other(options_, ChamberBox(), kRoot);
  const Waypoint beyond{{3, 0, 0}, 0};
  const int nearest = other.GrowToward(Context(), beyond, 40, random);
  for (const TreeNode& n : other.nodes())
    EXPECT_GE(LengthOf(n.at, beyond),
              LengthOf(other.nodes()[static_cast<std::size_t>(nearest)].at, beyond) - 1e-12);
}

TEST_F(NbvTreeTest, SpreadsWithoutGains) {
  NbvTree tree(options_, ChamberBox(), kRoot);
  Random random(3, "tree");
  tree.Spread(Context(), 20, random);
  EXPECT_EQ(tree.nodes().size(), 21u);
  EXPECT_EQ(tree.best(), 0);
  ExpectSound(tree);
}

TEST_F(NbvTreeTest, IsAFunctionOfItsSeed) {
  const NbvTree a = Grown(20, 5), b = Grown(20, 5), c = Grown(20, 6);
  for (std::size_t i = 1; i < a.nodes().size(); ++i) {
    EXPECT_EQ(a.nodes()[i].at.position_W_m, b.nodes()[i].at.position_W_m);
    EXPECT_EQ(a.nodes()[i].gain, b.nodes()[i].gain);
    EXPECT_NE(a.nodes()[i].at.position_W_m, c.nodes()[i].at.position_W_m);
  }
}

}  // namespace
}  // namespace vog
