#include "lib/submap/octree_file.h"

#include <cstring>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "lib/base/files.h"

namespace vog {
namespace {

constexpr int kTreeDepth = 16;
constexpr std::int32_t kKeyOrigin = 1 << (kTreeDepth - 1);
// A node on disk: 32 bits of log-odds, little-endian, and a bit for each child.
constexpr std::size_t kNodeBytes = 5;
constexpr std::string_view kMagic = "# Octomap OcTree file";
constexpr std::string_view kBinaryMagic = "# Octomap OcTree binary file";
constexpr std::string_view kData = "\ndata\n";

/// The corner of a node's child with number 0..7, x lowest.
VoxelKey ChildCorner(const VoxelKey& corner, std::int32_t half, int child) {
  return {corner.x + (child & 1 ? half : 0), corner.y + (child & 2 ? half : 0),
          corner.z + (child & 4 ? half : 0)};
}

/// Writes the nodes of a pruned octree, depth first, parents before children. A parent's value is
/// the largest of its children's; eight equal leaves become one.
class NodeWriter {
 public:
  explicit NodeWriter(const BrickGrid& grid) : grid_(grid), bounds_(grid.BrickBox()) {}

  /// Returns the number of nodes.
  std::size_t Write(std::string& out) {
    Append({-kKeyOrigin, -kKeyOrigin, -kKeyOrigin}, 2 * kKeyOrigin, out);
    return out.size() / kNodeBytes;
  }

 private:
  struct Node {
    bool exists = false, is_leaf = false;
    LogOddsUnits units = kUnknownUnits;
  };

  bool IsEmpty(const VoxelKey& corner, std::int32_t side) const {
    if (bounds_.is_empty || corner.x > bounds_.max.x || corner.y > bounds_.max.y ||
        corner.z > bounds_.max.z || corner.x + side <= bounds_.min.x ||
        corner.y + side <= bounds_.min.y || corner.z + side <= bounds_.min.z)
      return true;
    return side == BrickGrid::kBrickSide && !grid_.HasBrickAt(corner);
  }

  Node Append(const VoxelKey& corner, std::int32_t side, std::string& out) {
    if (IsEmpty(corner, side)) return {};
    if (side == 1) {
      const LogOddsUnits units = grid_.Get(corner);
      if (units == kUnknownUnits) return {};
      AppendNode(units, 0, out);
      return {true, true, units};
    }
    const std::size_t at = out.size();
    AppendNode(0, 0, out);  // Filled in below.
    Node node;
    int children = 0, equal_leaves = 0;
    Node first;
    for (int child = 0; child < 8; ++child) {
      const Node below = Append(ChildCorner(corner, side / 2, child), side / 2, out);
      if (!below.exists) continue;
      if (children == 0) first = below;
      children |= 1 << child;
      node.exists = true;
      node.units = std::max(node.units, below.units);
      equal_leaves += below.is_leaf && below.units == first.units;
    }
    out.resize(node.exists ? out.size() : at);
    if (!node.exists) return {};
    node.is_leaf = equal_leaves == 8;
    if (node.is_leaf) out.resize(at + kNodeBytes);
    SetNode(node.units, node.is_leaf ? 0 : children, out.data() + at);
    return node;
  }

  static void SetNode(LogOddsUnits units, int children, char* at) {
    const float log_odds = ToLogOdds(units);
    std::memcpy(at, &log_odds, sizeof(log_odds));
    at[sizeof(log_odds)] = static_cast<char>(children);
  }
  static void AppendNode(LogOddsUnits units, int children, std::string& out) {
    char node[kNodeBytes];
    SetNode(units, children, node);
    out.append(node, kNodeBytes);
  }

  const BrickGrid& grid_;
  BrickGrid::VoxelBounds bounds_;
};

/// Fills the cube of voxels that a leaf stands for. One of more than a few metres is no submap's.
bool Fill(const VoxelKey& corner, std::int32_t side, LogOddsUnits units, BrickGrid& grid) {
  constexpr std::int32_t kMaxLeaf = 256;
  if (side > kMaxLeaf) return false;
  // Brick by brick; a leaf smaller than a brick lies in one.
  const std::int32_t step = std::min(side, BrickGrid::kBrickSide);
  for (std::int32_t z = 0; z < side; z += step)
    for (std::int32_t y = 0; y < side; y += step)
      for (std::int32_t x = 0; x < side; x += step)
        grid.FillInBrick({corner.x + x, corner.y + y, corner.z + z}, step, units);
  return true;
}

/// Reads nodes into a grid. Stops at anything that is no octree.
class NodeReader {
 public:
  NodeReader(std::string_view bytes, BrickGrid& grid) : bytes_(bytes), grid_(grid) {}

  /// The number of nodes; nothing if they are deeper than a tree, cut short, too long, or not
  /// finite.
  std::optional<std::size_t> Read() {
    if (!ReadNode({-kKeyOrigin, -kKeyOrigin, -kKeyOrigin}, 2 * kKeyOrigin) || at_ != bytes_.size())
      return std::nullopt;
    return bytes_.size() / kNodeBytes;
  }

 private:
  bool ReadNode(const VoxelKey& corner, std::int32_t side) {
    if (side == 0 || bytes_.size() - at_ < kNodeBytes) return false;
    float log_odds;
    std::memcpy(&log_odds, bytes_.data() + at_, sizeof(log_odds));
    const auto children = static_cast<unsigned char>(bytes_[at_ + sizeof(log_odds)]);
    at_ += kNodeBytes;
    if (children == 0)
      return std::isfinite(log_odds) && Fill(corner, side, ToUnits(log_odds), grid_);
    for (int child = 0; child < 8; ++child) {
      if ((children >> child & 1) && !ReadNode(ChildCorner(corner, side / 2, child), side / 2))
        return false;
    }
    return true;
  }

  std::string_view bytes_;
  BrickGrid& grid_;
  std::size_t at_ = 0;
};

/// The same for the nodes of a .bt file: two bits a child, which is unknown, free, occupied, or an
/// inner node that follows. A tree that is one leaf cannot be told.
class BinaryNodeReader {
 public:
  BinaryNodeReader(std::string_view bytes, LogOddsUnits free, LogOddsUnits occupied,
                   BrickGrid& grid)
      : bytes_(bytes), free_(free), occupied_(occupied), grid_(grid) {}

  /// The number of nodes, leaves too; nothing as above.
  std::optional<std::size_t> Read() {
    if (!ReadInner({-kKeyOrigin, -kKeyOrigin, -kKeyOrigin}, 2 * kKeyOrigin) || at_ != bytes_.size())
      return std::nullopt;
    return nodes_;
  }

 private:
  enum Child { kUnknown = 0, kFree = 1, kOccupied = 2, kInner = 3 };

  bool ReadInner(const VoxelKey& corner, std::int32_t side) {
    if (side == 1 || bytes_.size() - at_ < 2) return false;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes_[at_ + i]); };
    const int children = byte(0) | byte(1) << 8;
    at_ += 2;
    ++nodes_;
    for (int child = 0; child < 8; ++child) {
      const VoxelKey at = ChildCorner(corner, side / 2, child);
      const int kind = children >> 2 * child & 3;
      if (kind == kInner) {
        if (!ReadInner(at, side / 2)) return false;
      } else if (kind != kUnknown) {
        ++nodes_;
        if (!Fill(at, side / 2, kind == kFree ? free_ : occupied_, grid_)) return false;
      }
    }
    return true;
  }

  std::string_view bytes_;
  LogOddsUnits free_, occupied_;
  BrickGrid& grid_;
  std::size_t at_ = 0, nodes_ = 0;
};

struct Header {
  std::string id;
  std::size_t size = 0;
  double resolution_m = 0;
  std::size_t end = 0;  // Where the nodes begin.
};

std::optional<Header> ReadHeader(std::string_view bytes, std::string_view magic) {
  constexpr std::size_t kMaxHeader = 4096;
  const std::size_t data = bytes.substr(0, kMaxHeader).find(kData);
  if (!bytes.starts_with(magic) || data == std::string_view::npos) return std::nullopt;
  Header header;
  header.end = data + kData.size();
  std::istringstream lines{std::string(bytes.substr(0, data))};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "id") words >> header.id;
    if (key == "size") words >> header.size;
    if (key == "res") words >> header.resolution_m;
  }
  return header;
}

/// The grid of the nodes behind a header, which `read(nodes, grid)` counts; or why there is none.
template <class Read>
std::variant<BrickGrid, std::string> FromNodes(const Header& header, std::string_view bytes,
                                               Read read) {
  if (header.id != "OcTree") return "an octree of type " + header.id + ", not OcTree";
  if (!(header.resolution_m > 1e-4 && header.resolution_m < 1e4))
    return "an octree with an impossible resolution";
  BrickGrid grid(header.resolution_m);
  const std::string_view nodes = bytes.substr(header.end);
  if (nodes.empty() && header.size == 0) return grid;
  try {
    if (read(nodes, grid) != header.size) return "a truncated or damaged octree";
  } catch (const std::length_error& error) {
    return error.what();
  }
  grid.Compact();
  return grid;
}

}  // namespace

std::string ToOctreeBytes(const BrickGrid& grid) {
  std::string nodes;
  const std::size_t count = NodeWriter(grid).Write(nodes);
  std::ostringstream header;
  header << kMagic
         << "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
            "id OcTree\nsize "
         << count << "\nres " << ToText(grid.grid().voxel_size_m()) << kData;
  return std::move(header).str() + nodes;
}

std::variant<BrickGrid, std::string> FromOctreeBytes(std::string_view bytes) {
  const auto header = ReadHeader(bytes, kMagic);
  if (!header) return "not an OctoMap .ot file";
  return FromNodes(*header, bytes, [](std::string_view nodes, BrickGrid& grid) {
    return NodeReader(nodes, grid).Read();
  });
}

std::variant<BrickGrid, std::string> FromBinaryOctreeBytes(std::string_view bytes,
                                                           const SensorModel& model) {
  const auto header = ReadHeader(bytes, kBinaryMagic);
  if (!header) return "not an OctoMap .bt file";
  const auto free = static_cast<LogOddsUnits>(model.min),
             occupied = static_cast<LogOddsUnits>(model.max);
  return FromNodes(*header, bytes, [&](std::string_view nodes, BrickGrid& grid) {
    return BinaryNodeReader(nodes, free, occupied, grid).Read();
  });
}

}  // namespace vog
