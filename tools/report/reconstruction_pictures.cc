#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "lib/evaluation/cloud_error.h"
#include "lib/geometry/cloud_file.h"
#include "tools/report/html.h"
#include "tools/report/pictures.h"
#include "tools/report/view.h"

namespace vog {
namespace {

constexpr int kWidth_px = 1100, kHeight_px = 380;
constexpr int kPanelGap_px = 6, kTitle_px = 26, kScaleBar_px = 24, kColourBar_px = 70;
constexpr std::size_t kMaxPoints = 150'000;
// Of a square that covers a pixel [gnuplot's point size].
constexpr double kPointSizePerPx = 0.09;

/// A look from above and to one side, without perspective.
struct Camera {
  Vec3 right, up, forward;

  static Camera From(double azimuth, double elevation) {
    Camera camera;
    camera.forward = -Vec3(std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    camera.right = camera.forward.cross(Vec3::UnitZ()).normalized();
    camera.up = camera.right.cross(camera.forward);
    return camera;
  }
  Vec3 Project(const Vec3& p_W) const { return {right.dot(p_W), up.dot(p_W), forward.dot(p_W)}; }
};

/// A reconstruction laid onto the true one.
struct Panel {
  std::string title;
  std::vector<Vec3> points_W;
  std::vector<float> distance_m;
  double rmse_m = 0;
};

std::optional<Panel> MakePanel(const std::filesystem::path& file, const std::string& title,
                               const std::vector<Vec3>& truth_W) {
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  const std::vector<Vec3> cloud = ReadCloud(file).points_V;
  if (cloud.empty()) return std::nullopt;
  CloudError error = MeasureCloud(cloud, truth_W);
  Panel panel{title, {}, std::move(error.distance_m), error.rmse_m};
  for (const Vec3& p : cloud) panel.points_W.push_back(error.X_truth_cloud * p);
  return panel;
}

/// Every n-th of so many points is enough to be drawn.
std::size_t StepFor(std::size_t points) { return points / kMaxPoints + 1; }

std::string TruthData(const std::vector<Vec3>& truth_W, const Camera& camera) {
  std::string text;
  for (std::size_t i = 0; i < truth_W.size(); i += StepFor(truth_W.size())) {
    const Vec3 p = camera.Project(truth_W[i]);
    text += DataLine({p.x(), p.y()});
  }
  return text;
}

/// Far points first, so that near ones hide them.
std::string PanelData(const Panel& panel, const Camera& camera) {
  std::vector<std::pair<Vec3, float>> points;
  for (std::size_t i = 0; i < panel.points_W.size(); i += StepFor(panel.points_W.size()))
    points.emplace_back(camera.Project(panel.points_W[i]), panel.distance_m[i]);
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& a, const auto& b) { return a.first.z() > b.first.z(); });
  std::string text;
  for (const auto& [p, distance_m] : points) text += DataLine({p.x(), p.y(), distance_m});
  return text;
}

/// A round number of metres that all but a few points of all panels stay under.
double ColourScale(const std::vector<Panel>& panels) {
  std::vector<float> distances;
  for (const Panel& panel : panels)
    distances.insert(distances.end(), panel.distance_m.begin(), panel.distance_m.end());
  const auto high =
      distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) * 98 / 100);
  std::nth_element(distances.begin(), high, distances.end());
  return std::max(0.1, std::ceil(*high / 0.05) * 0.05);
}

Eigen::AlignedBox3d ProjectedBounds(const std::vector<Panel>& panels,
                                    const std::vector<Vec3>& truth_W, const Camera& camera) {
  Eigen::AlignedBox3d bounds;
  for (const Vec3& p : truth_W) bounds.extend(camera.Project(p));
  for (const Panel& panel : panels)
    for (const Vec3& p : panel.points_W) bounds.extend(camera.Project(p));
  return bounds;
}

/// With millimetres, as in the table.
std::string Metres(double length_m) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.3f m", length_m);
  return text.data();
}

/// 1, 2 or 5 times a power of ten, at most `length`.
double RoundLength(double length) {
  const double power = std::pow(10, std::floor(std::log10(length)));
  return length >= 5 * power ? 5 * power : length >= 2 * power ? 2 * power : power;
}

/// The place of the panels and the ranges that give all of them one scale.
class PanelLayout {
 public:
  PanelLayout(const Eigen::AlignedBox3d& bounds, std::size_t panels) {
    const double count = static_cast<double>(panels);
    width_px_ = (kWidth_px - kColourBar_px - (count - 1) * kPanelGap_px) / count;
    height_px_ = kHeight_px - kTitle_px - kScaleBar_px;
    const Vec3 size = bounds.sizes().cwiseMax(0.1);
    m_per_px_ = 1.04 * std::max(size.x() / width_px_, size.y() / height_px_);
    center_ = bounds.center();
  }

  double px_per_m() const { return 1 / m_per_px_; }
  double right_px() const { return kWidth_px - kColourBar_px; }

  /// Margins and ranges of a panel.
  std::string Commands(std::size_t panel) const {
    const double left_px = static_cast<double>(panel) * (width_px_ + kPanelGap_px);
    const double half_x = 0.5 * width_px_ * m_per_px_, half_y = 0.5 * height_px_ * m_per_px_;
    return "set lmargin at screen " + PlotNumber(left_px / kWidth_px) + "\nset rmargin at screen " +
           PlotNumber((left_px + width_px_) / kWidth_px) + "\nset bmargin at screen " +
           PlotNumber(1.0 * kScaleBar_px / kHeight_px) + "\nset tmargin at screen " +
           PlotNumber((kScaleBar_px + height_px_) / kHeight_px) + "\nset xrange [" +
           PlotNumber(center_.x() - half_x) + ":" + PlotNumber(center_.x() + half_x) +
           "]\nset yrange [" + PlotNumber(center_.y() - half_y) + ":" +
           PlotNumber(center_.y() + half_y) + "]\n";
  }

  /// A bar of a round length under the first panel.
  std::string ScaleBar() const {
    const double length_m = RoundLength(0.35 * width_px_ * m_per_px_);
    const double end = (8 + length_m / m_per_px_) / kWidth_px;
    const double y = 10.0 / kHeight_px;
    return "set arrow 1 from screen " + PlotNumber(8.0 / kWidth_px) + "," + PlotNumber(y) +
           " to screen " + PlotNumber(end) + "," + PlotNumber(y) +
           " heads size screen 0.003,90 lw 1.4 lc rgb '#222222'\nset label 1 '" +
           PlotNumber(length_m) + " m' at screen " + PlotNumber(end + 0.006) + "," + PlotNumber(y) +
           "\n";
  }

 private:
  double width_px_ = 1, height_px_ = 1, m_per_px_ = 1;
  Vec3 center_;
};

std::string PanelCommands(const Panel& panel, const std::string& file, double point_size) {
  const std::string points = " with points pt 5 ps " + PlotNumber(point_size, 3);
  return "set title " + PlotText(panel.title + ": " + Metres(panel.rmse_m)) +
         " offset 0,-0.6\nplot 'truth'" + points + " lc rgb '#000000' notitle, '" + file +
         "' using 1:2:3" + points + " lc palette notitle\n" +
         "unset colorbox\nunset arrow 1\nunset label 1\n";
}

Picture DrawPanels(const std::vector<Panel>& panels, const std::vector<Vec3>& truth_W,
                   double voxel_size_m) {
  const Camera camera = Camera::From(-60 * std::numbers::pi / 180, 28 * std::numbers::pi / 180);
  const PanelLayout layout(ProjectedBounds(panels, truth_W, camera), panels.size());
  const double point_size = kPointSizePerPx * layout.px_per_m() * voxel_size_m;
  Plot plot;
  plot.format = PictureFormat::kPng;
  plot.width_px = kWidth_px;
  plot.height_px = kHeight_px;
  plot.data["truth"] = TruthData(truth_W, camera);
  plot.commands =
      "set palette maxcolors 25 defined (0 '#1f2f9c', 0.3 '#1d87c4', 0.55 '#3cb98a', 0.8 "
      "'#c5c13a', 1 '#ffe81a')\nset cbrange [0:" +
      PlotNumber(ColourScale(panels)) +
      "]\nset cblabel 'distance from the true one [m]' offset 0.5,0\nunset xtics\nunset ytics\n"
      "set cbtics tc rgb '#24292f'\nset border lc rgb '#d8dee4'\nset colorbox user origin screen " +
      PlotNumber((layout.right_px() + 8) / kWidth_px) + ",0.1 size screen 0.011,0.78\n" +
      layout.ScaleBar() + "set multiplot\n";
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::string file = "panel" + std::to_string(i);
    plot.data[file] = PanelData(panels[i], camera);
    plot.commands += layout.Commands(i) + PanelCommands(panels[i], file, point_size);
  }
  plot.commands += "unset multiplot\n";
  return DrawPlot(plot);
}

}  // namespace

std::string ReconstructionHtml(const std::filesystem::path& folder, double voxel_size_m) {
  const std::filesystem::path truth_file = folder / "reconstruction_truth.ply";
  const std::vector<Vec3> truth_W = std::filesystem::is_regular_file(truth_file)
                                        ? ReadCloud(truth_file).points_V
                                        : std::vector<Vec3>();
  std::vector<Panel> panels;
  for (const auto& [name, title] : {std::pair{"vog", "VOG-map with closures"},
                                    std::pair{"vog_no_lc", "VOG-map without closures"},
                                    std::pair{"standard", "standard global map"}}) {
    if (truth_W.empty()) break;
    const auto file = folder / (std::string("reconstruction_") + name + ".ply");
    if (auto panel = MakePanel(file, title, truth_W)) panels.push_back(std::move(*panel));
  }
  if (panels.empty()) return HtmlMissing("There are no reconstructions to compare with the truth.");
  return HtmlFigure(
      DrawPanels(panels, truth_W, voxel_size_m),
      "Occupied voxels of the three maps, coloured by their distance from the true reconstruction",
      "Occupied voxels after the registration to the reconstruction with true poses (black), and "
      "the root mean square of their distances from it.");
}

}  // namespace vog
