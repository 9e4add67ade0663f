#pragma once

#include <string>
#include <vector>

#include "lib/geometry/pose.h"
#include "lib/geometry/triangle_mesh.h"
#include "tools/report/gnuplot.h"

namespace vog {

/// A look along an axis of W: which coordinate goes right and which goes up.
struct View {
  int right = 0, up = 1;
  const char* right_label = "x [m]";
  const char* up_label = "y [m]";

  double RightOf(const Vec3& p) const { return p[right]; }
  double UpOf(const Vec3& p) const { return p[up]; }
  /// The coordinate that is looked along.
  int depth() const { return 3 - right - up; }
};

inline constexpr View kTopView{0, 1, "x [m]", "y [m]"};
inline constexpr View kSideView{0, 2, "x [m]", "z [m]"};

/// Room around the axes of a picture [px].
struct PlotMargins {
  int left = 52, right = 14, top = 34, bottom = 46;
};

/// A picture of `bounds_W` with equal axes: sets size, ranges, margins and labels.
Plot StartView(const View& view, const Eigen::AlignedBox3d& bounds_W, int width_px,
               PictureFormat format, const PlotMargins& margins = {});

/// How a mesh looks in a view, as if by X-rays: an image of lines `right up shade`, where the shade
/// (0 to 1) grows with the surface that lies behind each other, NaN where there is none.
std::string MeshShadow(const TriangleMesh& mesh_W, const View& view);

/// The commands before `plot`, and its part, that draw a file of MeshShadow() faintly.
std::string ShadowCommands();
std::string ShadowPlot(const std::string& file);

/// A rectangle around a box, dashed.
std::string BoxCommand(const View& view, const Eigen::AlignedBox3d& box_W);

}  // namespace vog
