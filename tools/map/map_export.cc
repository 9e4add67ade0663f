#include "tools/map/map_export.h"

#include <octomap/OcTree.h>

#include <bit>
#include <sstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/geometry/cloud_file.h"
#include "lib/submap/octree_file.h"
#include "lib/vogmap/merged_grid.h"

namespace vog {
namespace {

/// OctoMap's own form without log-odds; it thresholds and writes it best itself.
std::string ToBinaryOctree(const BrickGrid& grid) {
  std::istringstream bytes(ToOctreeBytes(grid));
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(bytes));
  auto& tree = dynamic_cast<octomap::OcTree&>(*read);
  std::ostringstream out;
  tree.writeBinary(out);
  return std::move(out).str();
}

template <class T>
void AppendBigEndian(T value, std::string& out) {
  auto bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(bits >> shift));
}

/// Legacy VTK, binary: a vertex a voxel.
std::string ToVtk(const BrickGrid& grid) {
  std::string points, cells, scalars;
  std::uint32_t count = 0;
  grid.ForEach([&](const VoxelKey& key, LogOddsUnits units) {
    for (const float coordinate : Eigen::Vector3f(grid.grid().CenterOf(key).cast<float>()))
      AppendBigEndian(coordinate, points);
    AppendBigEndian<std::uint32_t>(1, cells);
    AppendBigEndian(count++, cells);
    AppendBigEndian(ToLogOdds(units), scalars);
  });
  const std::string n = std::to_string(count);
  return "# vtk DataFile Version 3.0\nVOG-map\nBINARY\nDATASET POLYDATA\nPOINTS " + n + " float\n" +
         points + "\nVERTICES " + n + " " + std::to_string(2 * count) + "\n" + cells +
         "\nPOINT_DATA " + n + "\nSCALARS log_odds float 1\nLOOKUP_TABLE default\n" + scalars +
         "\n";
}

}  // namespace

void ExportMap(const VogMap& map, const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  const bool is_known = ending == ".ot" || ending == ".bt" || ending == ".ply" ||
                        ending == ".pcd" || ending == ".vtk";
  if (!is_known)
    throw UsageError(path.string() + ": a map is exported as .ot, .bt, .ply, .pcd or .vtk");
  const BrickGrid merged = MergedGrid(map);
  if (ending == ".ot") {
    WriteFileAtomically(path, ToOctreeBytes(merged));
  } else if (ending == ".bt") {
    WriteFileAtomically(path, ToBinaryOctree(merged));
  } else if (ending == ".vtk") {
    WriteFileAtomically(path, ToVtk(merged));
  } else {
    WriteCloud(path, OccupiedPoints(merged, ToUnits(map.occupied_from())));
  }
}

}  // namespace vog
