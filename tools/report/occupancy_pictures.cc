#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "lib/vogmap/merged_grid.h"
#include "tools/report/html.h"
#include "tools/report/pictures.h"
#include "tools/report/view.h"

namespace vog {
namespace {

constexpr int kWidth_px = 540;
constexpr double kRoom_m = 0.5;

struct Voxel {
  VoxelKey key;
  bool is_occupied;
};

/// Everything that the map knows, and what of it is worth a picture.
struct KnownSpace {
  double voxel_size_m = 0;
  std::vector<Voxel> voxels;
  Eigen::AlignedBox3d bounds_W;  ///< Of the exploration box and most occupied voxels.
};

/// Widens the bounds to all but a few far occupied voxels: single false returns lie anywhere.
void ExtendToMost(int axis, KnownSpace& space) {
  const VoxelGrid grid(space.voxel_size_m);
  std::vector<double> places;
  for (const Voxel& voxel : space.voxels) {
    if (voxel.is_occupied) places.push_back(grid.CenterOf(voxel.key)[axis]);
  }
  if (places.empty()) return;
  std::sort(places.begin(), places.end());
  const std::size_t few = places.size() / 100;
  double& min = space.bounds_W.min()[axis];
  double& max = space.bounds_W.max()[axis];
  min = std::min(min, places[few]);
  max = std::max(max, places[places.size() - 1 - few]);
}

/// The submaps where odometry alone has them, from where the first one is. @pre there is one.
StoredMap AtOdometry(StoredMap map) {
  const Submap& first = *map.submaps.front();
  const Pose3 X_WO = map.X_WM.at(first.id()) * first.base.odometry.X_OB.inverse();
  for (const SubmapPtr& submap : map.submaps)
    map.X_WM[submap->id()] = X_WO * submap->base.odometry.X_OB;
  return map;
}

KnownSpace ReadKnownSpace(const StoredMap& stored) {
  const VogMap map = ToVogMap(stored);
  KnownSpace space;
  space.voxel_size_m = stored.voxel_size_m;
  const BrickGrid merged = MergedGrid(map);
  merged.ForEach([&](const VoxelKey& key, LogOddsUnits units) {
    const bool is_occupied = map.IsOccupied(ToLogOdds(units));
    space.voxels.push_back({key, is_occupied});
  });
  return space;
}

void FitBounds(const RunFolder& run, KnownSpace& space) {
  if (run.exploration_box_W) space.bounds_W = *run.exploration_box_W;
  for (int axis = 0; axis < 3; ++axis) ExtendToMost(axis, space);
  const Vec3 room = Vec3::Constant(kRoom_m);
  space.bounds_W = {space.bounds_W.min() - room, space.bounds_W.max() + room};
}

/// A picture's cells, each with the number of occupied voxels behind each other.
class ColumnGrid {
 public:
  ColumnGrid(const KnownSpace& space, const View& view) : view_(view) {
    const VoxelGrid grid(space.voxel_size_m);
    const VoxelBox box = VoxelsOf(grid, space.bounds_W);
    min_ = box.min;
    columns_ = Coordinate(box.max, view.right) - Coordinate(box.min, view.right) + 1;
    rows_ = Coordinate(box.max, view.up) - Coordinate(box.min, view.up) + 1;
    occupied_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                     kUnknown);
  }

  void Add(const Voxel& voxel) {
    const int column = Coordinate(voxel.key, view_.right) - Coordinate(min_, view_.right);
    const int row = Coordinate(voxel.key, view_.up) - Coordinate(min_, view_.up);
    if (column < 0 || column >= columns_ || row < 0 || row >= rows_) return;
    int& count = occupied_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                           static_cast<std::size_t>(column)];
    count = std::max(count, 0) + voxel.is_occupied;
  }

  /// Lines `right up metres`: how much is occupied; NaN where nothing is known.
  std::string ToImage(double voxel_size_m) const {
    const auto center_m = [&](int axis, int cell) {
      return (Coordinate(min_, axis) + cell + 0.5) * voxel_size_m;
    };
    return ImageData(
        columns_, rows_, [&](int column) { return center_m(view_.right, column); },
        [&](int row) { return center_m(view_.up, row); },
        [&](std::size_t i) {
          return occupied_[i] == kUnknown ? std::numeric_limits<double>::quiet_NaN()
                                          : occupied_[i] * voxel_size_m;
        });
  }

  /// What all but few of the occupied columns stay under.
  int HighCount() const {
    std::vector<int> counts;
    std::copy_if(occupied_.begin(), occupied_.end(), std::back_inserter(counts),
                 [](int count) { return count > 0; });
    if (counts.empty()) return 1;
    const auto high = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() * 98 / 100);
    std::nth_element(counts.begin(), high, counts.end());
    return *high;
  }

 private:
  static constexpr int kUnknown = -1;

  static std::int32_t Coordinate(const VoxelKey& key, int axis) {
    return axis == 0 ? key.x : axis == 1 ? key.y : key.z;
  }

  View view_;
  VoxelKey min_;
  int columns_ = 0, rows_ = 0;
  std::vector<int> occupied_;
};

Picture DrawColumns(const KnownSpace& space, const RunFolder& run, const View& view,
                    const ColumnGrid& grid, double max_m) {
  Plot plot = StartView(view, space.bounds_W, kWidth_px, PictureFormat::kPng,
                        {.left = 52, .right = max_m > 0 ? 104 : 14, .top = 14, .bottom = 46});
  if (run.exploration_box_W) plot.commands += BoxCommand(view, *run.exploration_box_W);
  plot.data["image"] = grid.ToImage(space.voxel_size_m);
  plot.commands +=
      max_m > 0
          ? "set palette defined (0 '#dfeaf4', 0.0001 '#dfeaf4', 0.0002 '#f6c28b', 0.35 '#d9730d', "
            "1 '#3d1300')\nset cblabel 'occupied [m]' offset 0.5,0\nset cbrange [0:" +
                PlotNumber(max_m) + "]\n"
          : "set palette defined (0 '#dfeaf4', 0.5 '#dfeaf4', 0.5 '#7a2e00', 1 '#7a2e00')\n"
            "unset colorbox\nset cbrange [0:" +
                PlotNumber(space.voxel_size_m) + "]\n";
  plot.commands += "set tics front\nplot 'image' with image notitle";
  return DrawPlot(plot);
}

Picture DrawProjection(const KnownSpace& space, const RunFolder& run, const View& view) {
  ColumnGrid grid(space, view);
  for (const Voxel& voxel : space.voxels) grid.Add(voxel);
  return DrawColumns(space, run, view, grid, grid.HighCount() * space.voxel_size_m);
}

Picture DrawSlice(const KnownSpace& space, const RunFolder& run, std::int32_t z) {
  ColumnGrid grid(space, kTopView);
  for (const Voxel& voxel : space.voxels) {
    if (voxel.key.z == z) grid.Add(voxel);
  }
  return DrawColumns(space, run, kTopView, grid, 0);
}

/// The height at which the vehicle was half of the time above and half below.
double MedianHeight(const Trajectory& path) {
  if (path.empty()) return 0;
  std::vector<double> heights;
  for (const TimedPose& pose : path) heights.push_back(pose.X_WB.translation().z());
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

}  // namespace

std::string OccupancyHtml(const RunFolder& run) try {
  KnownSpace space = ReadKnownSpace(run.map);
  if (space.voxels.empty()) return HtmlMissing("The map knows nothing.");
  FitBounds(run, space);
  KnownSpace reckoned = ReadKnownSpace(AtOdometry(run.map));
  reckoned.bounds_W = space.bounds_W;
  const double z_m = MedianHeight(run.estimate);
  const std::int32_t layer = VoxelGrid(space.voxel_size_m).KeyOf({0, 0, z_m}).z;
  const std::string legend =
      " <span class=\"swatch\" style=\"background:#dfeaf4\"></span> known to be free, "
      "<span class=\"swatch\" style=\"background:#fff\"></span> unknown";
  return HtmlRow(
      {HtmlFigure(DrawProjection(space, run, kTopView), "Occupied voxels of the map from above",
                  "From above: metres of occupied voxels behind each other;" + legend + "."),
       HtmlFigure(DrawProjection(reckoned, run, kTopView),
                  "Occupied voxels from above without closures",
                  "The same submaps where odometry alone has them."),
       HtmlFigure(DrawProjection(space, run, kSideView), "Occupied voxels of the map from the side",
                  "From the side, looking along +y."),
       HtmlFigure(DrawSlice(space, run, layer), "A horizontal slice of the map",
                  "A slice at the vehicle's median height, z = " + PlotNumber(z_m, 3) +
                      " m: <span class=\"swatch\" style=\"background:#7a2e00\"></span> "
                      "occupied," +
                      legend + ".")});
} catch (const std::length_error&) {
  return HtmlMissing("The map is too large to be drawn as one grid.");
}

}  // namespace vog
