#include "tools/report/view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vog {
namespace {

constexpr int kMaxAxesHeight_px = 460;
constexpr int kShadowCells = 240;  // Along the longer side.
constexpr double kShades = 5;      // Each for twice the surface of the one before.

/// A grid over a mesh's bounds that collects the area of surface in each column.
class AreaGrid {
 public:
  AreaGrid(const TriangleMesh& mesh_W, const View& view) : view_(view) {
    const Eigen::AlignedBox3d bounds = mesh_W.Bounds();
    min_right_ = view.RightOf(bounds.min());
    min_up_ = view.UpOf(bounds.min());
    const double width = view.RightOf(bounds.max()) - min_right_;
    const double height = view.UpOf(bounds.max()) - min_up_;
    cell_m_ = std::max({width, height, 1e-6}) / kShadowCells;
    columns_ = static_cast<int>(width / cell_m_) + 1;
    rows_ = static_cast<int>(height / cell_m_) + 1;
    area_m2_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
  }

  /// Spreads a triangle's area over samples a third of a cell apart.
  void AddTriangle(std::array<Vec3, 3> corners) {
    // The first two edges from corner 0 are its shortest and another: few samples on needles.
    const auto side = [&](int i) { return (corners[(i + 1) % 3] - corners[i]).squaredNorm(); };
    const int shortest = side(0) <= side(1) && side(0) <= side(2) ? 0 : side(1) <= side(2) ? 1 : 2;
    std::rotate(corners.begin(), corners.begin() + shortest, corners.end());
    const Vec3 a = corners[1] - corners[0], b = corners[2] - corners[0];
    const double step_m = cell_m_ / 3;
    const int na = static_cast<int>(a.norm() / step_m) + 1;
    const int nb = static_cast<int>(b.norm() / step_m) + 1;
    const double share = a.cross(b).norm() / (static_cast<double>(na) * nb);
    for (int i = 0; i < na; ++i)
      for (int k = 0; k < nb; ++k) {
        const double s = (i + 0.5) / na, t = (k + 0.5) / nb;
        // The half beyond the triangle is folded back onto it.
        const bool is_beyond = s + t > 1;
        const Vec3 p = corners[0] + (is_beyond ? 1 - s : s) * a + (is_beyond ? 1 - t : t) * b;
        At(Column(p), Row(p)) += 0.5 * share;
      }
  }

  std::string ToImage() const {
    return ImageData(
        columns_, rows_, [this](int column) { return min_right_ + (column + 0.5) * cell_m_; },
        [this](int row) { return min_up_ + (row + 0.5) * cell_m_; },
        [this](std::size_t i) { return ShadeOf(area_m2_[i] / (cell_m_ * cell_m_)); });
  }

 private:
  int Column(const Vec3& p) const {
    return std::clamp(static_cast<int>((view_.RightOf(p) - min_right_) / cell_m_), 0, columns_ - 1);
  }
  int Row(const Vec3& p) const {
    return std::clamp(static_cast<int>((view_.UpOf(p) - min_up_) / cell_m_), 0, rows_ - 1);
  }
  double& At(int column, int row) {
    return area_m2_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)];
  }
  /// `layers` of surface: a flat sheet across the view is one.
  static double ShadeOf(double layers) {
    if (layers < 0.1) return std::numeric_limits<double>::quiet_NaN();
    return std::clamp(std::round(std::log2(layers)), 0.0, kShades) / kShades;
  }

  View view_;
  double min_right_ = 0, min_up_ = 0, cell_m_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<double> area_m2_;
};

std::string RangeOf(const char* axis, double min, double max) {
  return std::string("set ") + axis + "range [" + PlotNumber(min, 9) + ":" + PlotNumber(max, 9) +
         "]\n";
}

}  // namespace

Plot StartView(const View& view, const Eigen::AlignedBox3d& bounds_W, int width_px,
               PictureFormat format, const PlotMargins& margins) {
  const double width_m = std::max(view.RightOf(bounds_W.max()) - view.RightOf(bounds_W.min()), 0.1);
  const double height_m = std::max(view.UpOf(bounds_W.max()) - view.UpOf(bounds_W.min()), 0.1);
  const double px_per_m =
      std::min((width_px - margins.left - margins.right) / width_m, kMaxAxesHeight_px / height_m);
  const int axes_width = std::max(static_cast<int>(std::lround(px_per_m * width_m)), 40);
  const int axes_height = std::max(static_cast<int>(std::lround(px_per_m * height_m)), 40);
  Plot plot;
  plot.format = format;
  plot.width_px = axes_width + margins.left + margins.right;
  plot.height_px = axes_height + margins.top + margins.bottom;
  const auto share = [](int part, int whole) {
    return PlotNumber(static_cast<double>(part) / whole, 9);
  };
  plot.commands =
      "set lmargin at screen " + share(margins.left, plot.width_px) + "\nset rmargin at screen " +
      share(margins.left + axes_width, plot.width_px) + "\nset bmargin at screen " +
      share(margins.bottom, plot.height_px) + "\nset tmargin at screen " +
      share(margins.bottom + axes_height, plot.height_px) + "\nset xlabel " +
      PlotText(view.right_label) + " offset 0,0.3\nset ylabel " + PlotText(view.up_label) +
      " offset 1.2,0\n" +
      RangeOf("x", view.RightOf(bounds_W.min()), view.RightOf(bounds_W.min()) + width_m) +
      RangeOf("y", view.UpOf(bounds_W.min()), view.UpOf(bounds_W.min()) + height_m);
  return plot;
}

std::string MeshShadow(const TriangleMesh& mesh_W, const View& view) {
  if (mesh_W.triangles.empty()) return "";
  AreaGrid grid(mesh_W, view);
  for (const auto& t : mesh_W.triangles)
    grid.AddTriangle({mesh_W.vertices[t[0]], mesh_W.vertices[t[1]], mesh_W.vertices[t[2]]});
  return grid.ToImage();
}

std::string ShadowCommands() {
  return "set palette defined (0 '#eceff2', 1 '#aeb9c4')\nset cbrange [0:1]\nunset "
         "colorbox\n";
}

std::string ShadowPlot(const std::string& file) { return PlotText(file) + " with image notitle"; }

std::string BoxCommand(const View& view, const Eigen::AlignedBox3d& box_W) {
  return "set object rectangle from " + PlotNumber(view.RightOf(box_W.min()), 9) + "," +
         PlotNumber(view.UpOf(box_W.min()), 9) + " to " + PlotNumber(view.RightOf(box_W.max()), 9) +
         "," + PlotNumber(view.UpOf(box_W.max()), 9) +
         " front fs empty border lc rgb '#8c959f' lw 1 dt (6,4)\n";
}

}  // namespace vog
