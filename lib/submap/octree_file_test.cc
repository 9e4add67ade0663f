#include "lib/submap/octree_file.h"

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <cstring>
#include <memory>
#include <sstream>

#include "lib/submap/submaps_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;
constexpr int kKeyOrigin = 32768;

octomap::OcTreeKey OctomapKey(const VoxelKey& key) {
  const auto index = [](int i) { return static_cast<octomap::key_type>(i + kKeyOrigin); };
  return {index(key.x), index(key.y), index(key.z)};
}

octomap::OcTree TreeOf(const VoxelTable& table) {
  octomap::OcTree tree(kVoxel_m);
  for (const auto& [key, units] : table)
    tree.setNodeValue(OctomapKey(key), ToLogOdds(units), /*lazy_eval=*/true);
  tree.updateInnerOccupancy();
  return tree;
}

std::string BytesOf(const octomap::AbstractOcTree& tree) {
  std::ostringstream bytes;
  tree.write(bytes);
  return std::move(bytes).str();
}

std::unique_ptr<octomap::OcTree> ReadByOctomap(const std::string& bytes) {
  std::istringstream stream(bytes);
  testing::internal::CaptureStderr();  // OctoMap tells what it reads.
  octomap::AbstractOcTree* tree = octomap::AbstractOcTree::read(stream);
  testing::internal::GetCapturedStderr();
  return std::unique_ptr<octomap::OcTree>(dynamic_cast<octomap::OcTree*>(tree));
}

std::string FaultOf(const std::string& bytes) {
  const auto grid = FromOctreeBytes(bytes);
  const auto* fault = std::get_if<std::string>(&grid);
  return fault == nullptr ? "no fault" : *fault;
}

/// A node of an .ot file.
std::string Node(float log_odds, int children) {
  std::string node(5, static_cast<char>(children));
  std::memcpy(node.data(), &log_odds, sizeof(log_odds));
  return node;
}

std::string File(const std::string& nodes, const std::string& type = "OcTree",
                 const std::string& resolution = "0.1") {
  return "# Octomap OcTree file\nid " + type + "\nsize " + std::to_string(nodes.size() / 5) +
         "\nres " + resolution + "\ndata\n" + nodes;
}

/// A leaf below `levels` nodes with one child each.
std::string Chain(int levels, float log_odds) {
  std::string nodes;
  for (int i = 0; i < levels; ++i) nodes += Node(0, 1);
  return nodes + Node(log_odds, 0);
}

TEST(OctreeFileTest, KeysAreOctomaps) {
  Random random(8, "octree_file");
  for (const double voxel_size_m : {0.095, 0.05, 0.3}) {
    const octomap::OcTree tree(voxel_size_m);
    const VoxelGrid grid(voxel_size_m);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p = RandomPoint(100, random);
      const VoxelKey key = grid.KeyOf(p);
      const octomap::OcTreeKey theirs = tree.coordToKey(p.x(), p.y(), p.z());
      EXPECT_EQ(OctomapKey(key), theirs);
      EXPECT_EQ(grid.CenterOf(key).x(), tree.keyToCoord(theirs[0]));
    }
  }
}

TEST(OctreeFileTest, OctomapReadsEveryVoxelAsItIs) {
  Random random(1, "octree_file");
  for (int round = 0; round < 10; ++round) {
    const VoxelTable table = RandomTable(600, 12, random);
    const auto tree = ReadByOctomap(ToOctreeBytes(GridOf(kVoxel_m, table)));
    ASSERT_NE(tree, nullptr);
    EXPECT_EQ(tree->getResolution(), kVoxel_m);
    for (int z = -14; z < 14; ++z)
      for (int y = -14; y < 14; ++y)
        for (int x = -14; x < 14; ++x) {
          const octomap::OcTreeNode* node = tree->search(OctomapKey({x, y, z}));
          const auto found = table.find({x, y, z});
          ASSERT_EQ(node != nullptr, found != table.end());
          if (node != nullptr) {
            ASSERT_EQ(node->getLogOdds(), ToLogOdds(found->second));
          }
        }
  }
}

TEST(OctreeFileTest, BytesAreThoseThatOctomapWrites) {
  Random random(2, "octree_file");
  for (const int voxels : {0, 1, 30, 3000}) {
    const VoxelTable table = voxels == 0 ? VoxelTable{} : RandomTable(voxels, 14, random);
    octomap::OcTree tree = TreeOf(table);
    tree.prune();
    EXPECT_TRUE(ToOctreeBytes(GridOf(kVoxel_m, table)) == BytesOf(tree)) << voxels;
  }
}

TEST(OctreeFileTest, ReadsBackWhatItWrote) {
  Random random(3, "octree_file");
  for (int round = 0; round < 20; ++round) {
    const double voxel_size_m = random.Uniform(0.005, 5);
    const BrickGrid grid = GridOf(voxel_size_m, RandomTable(400, 40, random));
    const auto read = FromOctreeBytes(ToOctreeBytes(grid));
    ASSERT_TRUE(std::holds_alternative<BrickGrid>(read)) << std::get<std::string>(read);
    EXPECT_EQ(TableOf(std::get<BrickGrid>(read)), TableOf(grid));
    EXPECT_EQ(std::get<BrickGrid>(read).grid().voxel_size_m(), voxel_size_m);
  }
}

TEST(OctreeFileTest, AnEmptyGridReadsBackEmpty) {
  const auto read = FromOctreeBytes(ToOctreeBytes(BrickGrid(0.2)));
  ASSERT_TRUE(std::holds_alternative<BrickGrid>(read));
  EXPECT_EQ(std::get<BrickGrid>(read).bricks(), 0u);
  EXPECT_EQ(std::get<BrickGrid>(read).grid().voxel_size_m(), 0.2);
}

TEST(OctreeFileTest, ReadsOctomapsFilesPrunedOrNot) {
  Random random(4, "octree_file");
  const VoxelTable table = RandomTable(2000, 12, random);
  octomap::OcTree tree = TreeOf(table);
  for (const bool pruned : {false, true}) {
    if (pruned) tree.prune();
    const auto read = FromOctreeBytes(BytesOf(tree));
    ASSERT_TRUE(std::holds_alternative<BrickGrid>(read));
    EXPECT_EQ(TableOf(std::get<BrickGrid>(read)), table);
  }
}

TEST(OctreeFileTest, RoundsOctomapsLogOddsToUnits) {
  Random random(5, "octree_file");
  octomap::OcTree tree(kVoxel_m);
  for (int i = 0; i < 300; ++i) {
    const octomap::point3d p(static_cast<float>(random.Uniform(-1, 1)),
                             static_cast<float>(random.Uniform(-1, 1)), 0);
    tree.insertRay({0, 0, 0}, p);
  }
  const auto read = FromOctreeBytes(BytesOf(tree));
  ASSERT_TRUE(std::holds_alternative<BrickGrid>(read));
  std::size_t voxels = 0;
  std::get<BrickGrid>(read).ForEach([&](const VoxelKey& key, LogOddsUnits units) {
    const octomap::OcTreeNode* node = tree.search(OctomapKey(key));
    ASSERT_NE(node, nullptr);
    EXPECT_NEAR(ToLogOdds(units), node->getLogOdds(), 1.0 / 64);
    ++voxels;
  });
  tree.expand();
  EXPECT_EQ(voxels, tree.getNumLeafNodes());
}

TEST(OctreeFileTest, ReadsCommentsInTheHeader) {
  const std::string header =
      "# Octomap OcTree file\n# size res id of a thing\nid OcTree\nsize 17\n";
  EXPECT_EQ(FaultOf(header + "# more\nres 0.1\ndata\n" + Chain(16, 1)), "no fault");
}

TEST(OctreeFileTest, TellsEveryTruncation) {
  Random random(6, "octree_file");
  const std::string bytes = ToOctreeBytes(GridOf(kVoxel_m, RandomTable(40, 6, random)));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string fault = FaultOf(bytes.substr(0, size));
    EXPECT_NE(fault, "no fault") << size;
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
  }
  EXPECT_EQ(FaultOf(bytes + "\n"), "a truncated or damaged octree");
}

TEST(OctreeFileTest, FlippedBitsNeverCrash) {
  Random random(7, "octree_file");
  const std::string bytes = ToOctreeBytes(GridOf(kVoxel_m, RandomTable(60, 6, random)));
  int told = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = bytes;
    for (int flips = random.Index(3); flips >= 0; --flips)
      damaged[random.Index(static_cast<int>(bytes.size()))] ^= 1 << random.Index(8);
    told += FaultOf(damaged) != "no fault";
  }
  EXPECT_GT(told, 300);
}

TEST(OctreeFileTest, SaysWhatIsWrong) {
  EXPECT_EQ(FaultOf(""), "not an OctoMap .ot file");
  EXPECT_EQ(FaultOf("# Octomap OcTree file\nid OcTree\n"), "not an OctoMap .ot file");
  EXPECT_EQ(FaultOf("solid cube"), "not an OctoMap .ot file");
  EXPECT_EQ(FaultOf(BytesOf(octomap::ColorOcTree(0.1))),
            "an octree of type ColorOcTree, not OcTree");
  for (const char* resolution : {"0", "-0.1", "nan", "1e9", "wide"})
    EXPECT_EQ(FaultOf(File(Chain(16, 1), "OcTree", resolution)),
              "an octree with an impossible resolution");
}

TEST(OctreeFileTest, RefusesTreesThatNoOctomapWouldWrite) {
  const std::string fault = "a truncated or damaged octree";
  EXPECT_EQ(FaultOf(File(Chain(16, 1))), "no fault");
  EXPECT_EQ(FaultOf(File(Chain(17, 1))), fault);      // Deeper than 16 levels.
  EXPECT_EQ(FaultOf(File(Chain(200000, 1))), fault);  // Much deeper: no stack overflow.
  EXPECT_EQ(FaultOf(File(Chain(0, 1))), fault);       // One leaf that is all of space.
  EXPECT_EQ(FaultOf(File(Chain(16, NAN))), fault);
  EXPECT_EQ(FaultOf(File(Chain(16, INFINITY))), fault);
  EXPECT_EQ(FaultOf(File(Node(0, 0xff) + Chain(15, 1))), fault);  // Children that are not there.
  EXPECT_EQ(FaultOf(File(Chain(16, 1) + Chain(0, 1))), fault);    // One node too many.
  std::string size = File(Chain(16, 1));
  EXPECT_EQ(FaultOf(size.replace(size.find("size 17"), 7, "size 18")), fault);
  // Leaves of 256 voxels a side; eight of them are more than a submap holds.
  std::string leaves;
  for (int i = 0; i < 7; ++i) leaves += Node(0, 1);
  leaves += Node(0, 0xff);
  for (int i = 0; i < 8; ++i) leaves += Node(1, 0);
  EXPECT_EQ(FaultOf(File(leaves)), "a submap has too many bricks");
}

std::string BinaryBytesOf(octomap::OcTree tree) {
  std::ostringstream out;
  tree.writeBinary(out);
  return std::move(out).str();
}

TEST(OctreeFileTest, ReadsOctomapsBinaryFiles) {
  Random random(9, "octree_file");
  const SensorModel model{SensorModelOptions{}};
  for (const int voxels : {0, 1, 30, 3000}) {
    const VoxelTable table = voxels == 0 ? VoxelTable{} : RandomTable(voxels, 14, random);
    VoxelTable expected;
    for (const auto& [key, units] : table) expected[key] = units >= 0 ? model.max : model.min;
    const auto read = FromBinaryOctreeBytes(BinaryBytesOf(TreeOf(table)), model);
    ASSERT_TRUE(std::holds_alternative<BrickGrid>(read)) << std::get<std::string>(read);
    EXPECT_EQ(TableOf(std::get<BrickGrid>(read)), expected);
    EXPECT_EQ(std::get<BrickGrid>(read).grid().voxel_size_m(), kVoxel_m);
  }
}

TEST(OctreeFileTest, DamagedBinaryFilesAreToldOrReadAsTheyAre) {
  Random random(10, "octree_file");
  const SensorModel model{SensorModelOptions{}};
  const std::string bytes = BinaryBytesOf(TreeOf(RandomTable(60, 6, random)));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_TRUE(
        std::holds_alternative<std::string>(FromBinaryOctreeBytes(bytes.substr(0, size), model)))
        << size;
  int told = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = bytes;
    damaged[random.Index(static_cast<int>(bytes.size()))] ^= 1 << random.Index(8);
    told += std::holds_alternative<std::string>(FromBinaryOctreeBytes(damaged, model));
  }
  EXPECT_GT(told, 300);
  EXPECT_EQ(std::get<std::string>(FromBinaryOctreeBytes(File(Chain(16, 1)), model)),
            "not an OctoMap .bt file");
  EXPECT_EQ(FaultOf(bytes), "not an OctoMap .ot file");
  // Much deeper than a tree: no stack overflow.
  const std::string deep(100000, '\3');
  EXPECT_TRUE(std::holds_alternative<std::string>(FromBinaryOctreeBytes(
      "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.1\ndata\n" + deep, model)));
}

}  // namespace
}  // namespace vog
