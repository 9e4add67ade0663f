#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/messages/graph_edges.h"
#include "lib/submap/sensor_model.h"
#include "tools/report/html.h"
#include "tools/report/key_figures.h"
#include "tools/report/pictures.h"

namespace vog {
namespace {

// A page of a long mission stays a few MB.
constexpr std::size_t kMostPictures = 24, kMostRejectedPictures = 8;
constexpr int kPanel_px = 150, kGap_px = 8, kTitle_px = 18;
constexpr int kMinNeighbours = 3;
constexpr const char* kUnknown = "–";

enum Owner { kTarget = 1, kSource = 2, kBoth = 3 };

/// How far a closure moves `to`: from where odometry had it.
std::optional<Pose3> CorrectionOf(const TriedClosure& closure) {
  if (!closure.X_ik_before) return std::nullopt;
  return Ominus(*closure.X_ik_before, closure.X_ik);
}

double MovedBy(const TriedClosure& closure) {
  const auto correction = CorrectionOf(closure);
  return correction ? correction->translation().norm() : 0;
}

SubmapPtr SubmapOf(const StoredMap& map, SubmapId id) {
  const auto found =
      std::lower_bound(map.submaps.begin(), map.submaps.end(), id,
                       [](const SubmapPtr& submap, SubmapId id) { return submap->id() < id; });
  return found != map.submaps.end() && (*found)->id() == id ? *found : nullptr;
}

// --- words ---

std::string NameOf(const TriedClosure& closure) {
  return std::to_string(closure.edge.from_id) + "–" + std::to_string(closure.edge.to_id);
}

/// A closure is tried when `to` has closed.
std::string TimeOf(const RunFolder& run, const TriedClosure& closure) {
  const SubmapPtr to = SubmapOf(run.map, closure.edge.to_id);
  return to ? Fixed(ToSeconds(to->last_scan), 1) : kUnknown;
}

const char* KindText(const TriedClosure& closure) {
  return closure.kind == graph_edge_t::FULL_CLOSURE ? "full" : "partial";
}

/// Of x, y and heading in W, which nothing else measures, those that the registration left free.
std::string FreeText(const RunFolder& run, const TriedClosure& closure) {
  graph_edge_t edge = closure.edge;
  edge.kind = closure.kind;
  const FreeMotions free = FreeMotionsOf(edge);
  const auto X_WM = run.map.X_WM.find(edge.to_id);
  if (X_WM == run.map.X_WM.end()) return kUnknown;
  // Of the projection onto all free directions the part in the horizontal plane.
  const auto horizontal = [&](const std::vector<Vec3>& directions_M) {
    Mat3 projection = Mat3::Zero();
    for (const Vec3& d_M : directions_M) {
      const Vec3 d = X_WM->second.linear() * d_M;
      projection += d * d.transpose();
    }
    return projection;
  };
  std::string text;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> plane(
      horizontal(free.directions).topLeftCorner<2, 2>());
  for (int i = 1; i >= 0; --i) {
    if (!(plane.eigenvalues()[i] > 0.5)) continue;
    const Eigen::Vector2d d = plane.eigenvectors().col(i);
    const double heading_deg = ToDegrees(std::atan2(d.y(), d.x()));
    text += (text.empty() ? "" : ", ") +
            Fixed(heading_deg < 0 ? heading_deg + 180 : heading_deg, 0) + "°";
  }
  if (horizontal(free.axes)(2, 2) > 0.5)
    text += (text.empty() ? "" : ", ") + std::string("heading");
  return text.empty() ? kUnknown : text;
}

std::vector<std::string> CorrectionText(const TriedClosure& closure) {
  const auto correction = CorrectionOf(closure);
  if (!correction) return {kUnknown, kUnknown};
  const double turn_rad = Log(*correction).tail<3>().norm();
  return {Fixed(correction->translation().norm(), 3), Fixed(ToDegrees(turn_rad), 2)};
}

std::string FateText(const TriedClosure& closure) {
  return closure.dropped ? "dropped at " + Fixed(ToSeconds(*closure.dropped), 1) + " s" : "holds";
}

// --- pictures ---

/// The cells of a panel: which of the two submaps is occupied there.
class OverlayGrid {
 public:
  OverlayGrid(const Eigen::AlignedBox2d& bounds, double cell_m)
      : min_(bounds.min()),
        cell_m_(cell_m),
        side_(static_cast<int>(bounds.sizes().maxCoeff() / cell_m) + 1),
        owners_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {}

  void Add(const std::vector<Vec3>& points_W, Owner owner) {
    for (const Vec3& p : points_W) {
      const double column = std::floor((p.x() - min_.x()) / cell_m_);
      const double row = std::floor((p.y() - min_.y()) / cell_m_);
      if (column < 0 || row < 0 || column >= side_ || row >= side_) continue;
      owners_[static_cast<std::size_t>(row) * static_cast<std::size_t>(side_) +
              static_cast<std::size_t>(column)] |= owner;
    }
  }

  /// Lines `x y owner`, NaN where nobody is.
  std::string ToImage() const {
    return ImageData(
        side_, side_, [this](int column) { return min_.x() + (column + 0.5) * cell_m_; },
        [this](int row) { return min_.y() + (row + 0.5) * cell_m_; },
        [this](std::size_t i) {
          return owners_[i] == 0 ? std::numeric_limits<double>::quiet_NaN() : owners_[i];
        });
  }

 private:
  Eigen::Vector2d min_;
  double cell_m_;
  int side_;
  std::vector<int> owners_;
};

/// A closure's two submaps as points in W, the source where it was and where it was found to be.
struct Overlay {
  std::vector<Vec3> target, source_before, source_after;
};

std::vector<Vec3> PointsAt(const Submap& submap, LogOddsUnits occupied_from, const Pose3& X_WM) {
  std::vector<Vec3> points = OccupiedPoints(submap.grid, occupied_from, kMinNeighbours);
  for (Vec3& p : points) p = X_WM * p;
  return points;
}

/// Nothing without both submaps or what was before.
std::optional<Overlay> OverlayOf(const RunFolder& run, const TriedClosure& closure) {
  const SubmapPtr target = SubmapOf(run.map, closure.edge.from_id);
  const SubmapPtr source = SubmapOf(run.map, closure.edge.to_id);
  const auto X_WI = run.map.X_WM.find(closure.edge.from_id);
  if (!target || !source || !closure.X_ik_before || X_WI == run.map.X_WM.end()) return std::nullopt;
  const LogOddsUnits occupied_from = SensorModel(run.map.sensor_model).occupied_from;
  return Overlay{PointsAt(*target, occupied_from, X_WI->second),
                 PointsAt(*source, occupied_from, X_WI->second * *closure.X_ik_before),
                 PointsAt(*source, occupied_from, X_WI->second * closure.X_ik)};
}

/// A square around all but a few far points, which false returns may make.
std::optional<Eigen::AlignedBox2d> SquareAround(const Overlay& overlay) {
  Eigen::AlignedBox2d box;
  for (const auto* points : {&overlay.target, &overlay.source_before, &overlay.source_after}) {
    if (points->empty()) return std::nullopt;
    for (int axis = 0; axis < 2; ++axis) {
      std::vector<double> places;
      for (const Vec3& p : *points) places.push_back(p[axis]);
      std::sort(places.begin(), places.end());
      const std::size_t few = places.size() / 100;
      const double low = places[few], high = places[places.size() - 1 - few];
      box.min()[axis] = std::min(box.min()[axis], low);
      box.max()[axis] = std::max(box.max()[axis], high);
    }
  }
  constexpr double kRoom_m = 0.3;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * box.sizes().maxCoeff() + kRoom_m);
  return Eigen::AlignedBox2d(box.center() - half, box.center() + half);
}

std::string PanelCommands(int panel, const std::string& title, const std::string& file) {
  constexpr double kWidth = 2 * kPanel_px + kGap_px, kHeight = kPanel_px + kTitle_px;
  const double left = panel * (kPanel_px + kGap_px);
  const auto share = [](double part, double whole) { return PlotNumber(part / whole, 9); };
  return "set lmargin at screen " + share(left + 1, kWidth) + "\nset rmargin at screen " +
         share(left + kPanel_px - 1, kWidth) + "\nset bmargin at screen " + share(1, kHeight) +
         "\nset tmargin at screen " + share(kPanel_px - 1, kHeight) + "\nset label 1 " +
         PlotText(title) + " at screen " + share(left + 2, kWidth) + "," +
         share(kPanel_px + kTitle_px / 2.0, kHeight) + " tc rgb '#24292f'\nplot " + PlotText(file) +
         " with image notitle\n";
}

/// Both submaps from above, before and after the registration; nothing where there are none.
std::optional<Picture> DrawOverlay(const RunFolder& run, const TriedClosure& closure) {
  const auto overlay = OverlayOf(run, closure);
  const auto square = overlay ? SquareAround(*overlay) : std::nullopt;
  // What damaged poses put far away has no place in a picture.
  constexpr double kLargest_m = 200;
  if (!square || !(square->sizes().maxCoeff() < kLargest_m)) return std::nullopt;
  const double cell_m = std::max(run.map.voxel_size_m, square->sizes().maxCoeff() / kPanel_px);
  const auto image = [&](const std::vector<Vec3>& source) {
    OverlayGrid grid(*square, cell_m);
    grid.Add(overlay->target, kTarget);
    grid.Add(source, kSource);
    return grid.ToImage();
  };
  Plot plot;
  plot.format = PictureFormat::kPng;
  plot.width_px = 2 * kPanel_px + kGap_px;
  plot.height_px = kPanel_px + kTitle_px;
  plot.data = {{"before", image(overlay->source_before)}, {"after", image(overlay->source_after)}};
  const auto range = [&](const char* axis, int i) {
    return std::string("set ") + axis + "range [" + PlotNumber(square->min()[i], 9) + ":" +
           PlotNumber(square->max()[i], 9) + "]\n";
  };
  plot.commands =
      "unset key\nunset tics\nunset colorbox\nset border 15 lc rgb '#8c959f' lw 0.5\n"
      "set palette defined (1 '#56b4e9', 2 '#e69f00', 3 '#1f2328')\nset cbrange [1:3]\n" +
      range("x", 0) + range("y", 1) + "set multiplot\n" + PanelCommands(0, "before", "before") +
      PanelCommands(1, "after", "after") + "unset multiplot";
  return DrawPlot(plot);
}

std::string CaptionOf(const RunFolder& run, const TriedClosure& closure) {
  std::string text = NameOf(closure) + " at " + TimeOf(run, closure) +
                     " s: " + (closure.was_accepted() ? KindText(closure) : closure.edge.reason) +
                     ", moved " + Fixed(MovedBy(closure), 2) + " m";
  if (closure.dropped) text += ", " + FateText(closure);
  return EscapeHtml(text);
}

/// Those that move most, in the order of time.
std::string PicturesHtml(const RunFolder& run, const std::vector<TriedClosure>& closures,
                         std::size_t most) {
  std::vector<const TriedClosure*> shown;
  for (const TriedClosure& closure : closures) shown.push_back(&closure);
  std::stable_sort(shown.begin(), shown.end(),
                   [](const auto* a, const auto* b) { return MovedBy(*a) > MovedBy(*b); });
  shown.resize(std::min(shown.size(), most));
  std::sort(shown.begin(), shown.end());
  std::vector<std::string> figures;
  for (const TriedClosure* closure : shown) {
    if (const auto picture = DrawOverlay(run, *closure))
      figures.push_back(HtmlFigure(
          *picture, "Submaps " + NameOf(*closure) + " from above, before and after registration",
          CaptionOf(run, *closure)));
  }
  return figures.empty() ? "" : HtmlRow(figures);
}

// --- lists ---

/// `head`, then a row a closure.
template <class RowOf>
std::string WideTable(std::vector<std::string> head, const std::vector<TriedClosure>& closures,
                      RowOf row_of) {
  std::vector<std::vector<std::string>> rows = {std::move(head)};
  for (const TriedClosure& closure : closures) rows.push_back(row_of(closure));
  return HtmlWide(HtmlTable(rows));
}

std::string JoinedTable(const RunFolder& run, const std::vector<TriedClosure>& joined) {
  return WideTable({"Submaps", "time [s]", "type", "directions", "left free", "χ²", "moved by [m]",
                    "turned by [°]", ""},
                   joined, [&](const TriedClosure& closure) -> std::vector<std::string> {
                     const auto moved = CorrectionText(closure);
                     return {NameOf(closure),
                             TimeOf(run, closure),
                             KindText(closure),
                             std::to_string(closure.edge.directions),
                             FreeText(run, closure),
                             PlotNumber(closure.edge.chi_square, 3),
                             moved[0],
                             moved[1],
                             FateText(closure)};
                   });
}

std::string RejectedTable(const RunFolder& run, const std::vector<TriedClosure>& rejected) {
  return WideTable(
      {"Submaps", "time [s]", "directions", "χ²", "moved by [m]", "turned by [°]", "because of"},
      rejected, [&](const TriedClosure& closure) -> std::vector<std::string> {
        const auto moved = CorrectionText(closure);
        return {NameOf(closure),
                TimeOf(run, closure),
                std::to_string(closure.edge.directions),
                PlotNumber(closure.edge.chi_square, 3),
                moved[0],
                moved[1],
                closure.edge.reason};
      });
}

std::string JoinedHtml(const RunFolder& run, const std::vector<TriedClosure>& joined) {
  if (joined.empty()) return HtmlMissing("No loop was closed.");
  const std::string pictures = PicturesHtml(run, joined, kMostPictures);
  const std::string legend =
      "<p>Both submaps from above, before and after their registration: <span class=\"swatch\" "
      "style=\"background:#56b4e9\"></span> the older one, <span class=\"swatch\" "
      "style=\"background:#e69f00\"></span> the newer one, <span class=\"swatch\" "
      "style=\"background:#1f2328\"></span> both." +
      (joined.size() > kMostPictures ? " Of " + std::to_string(joined.size()) + " closures those " +
                                           std::to_string(kMostPictures) + " that move most."
                                     : std::string()) +
      "</p>\n";
  const std::string note =
      "<p>Left free: along which line in x and y, as an angle from x, and whether the heading is. "
      "Depth, "
      "roll and pitch are measured.</p>\n";
  return (pictures.empty() ? "" : legend + pictures) + JoinedTable(run, joined) + note;
}

}  // namespace

std::string LoopClosuresHtml(const RunFolder& run) {
  std::vector<TriedClosure> joined, rejected;
  for (const TriedClosure& closure : run.closures)
    (closure.was_accepted() ? joined : rejected).push_back(closure);
  if (run.closures.empty()) return HtmlMissing("No loop closure was tried.");
  const std::string folded = rejected.empty()
                                 ? ""
                                 : "<details>\n<summary>" + std::to_string(rejected.size()) +
                                       " were tried and rejected.</summary>\n" +
                                       PicturesHtml(run, rejected, kMostRejectedPictures) +
                                       RejectedTable(run, rejected) + "</details>\n";
  return JoinedHtml(run, joined) + folded;
}

}  // namespace vog
