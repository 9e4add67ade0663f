#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "lib/posegraph/pose_graph.h"

namespace vog {

/// A measured relative pose, as a file has it.
struct G2oEdge {
  NodeId from = 0, to = 0;
  Pose3 X_ik = Pose3::Identity();
  Mat6 information = Mat6::Identity();  ///< Order x, y, z, rotation; see RotationInformation.
};

/// What a .g2o file holds: VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX, or in two dimensions VERTEX_SE2
/// and EDGE_SE2. Planar poses stand in the plane z = 0; the information of planar edges about z,
/// roll and pitch, which no file has, is 1.
struct G2oGraph {
  std::map<NodeId, Pose3> vertices;  ///< X_W.
  std::vector<G2oEdge> edges;
  std::set<NodeId> fixed;
  bool is_planar = false;
};

/// What the rotation part of an information matrix in three dimensions is about. Files do not say.
enum class RotationInformation {
  kRadians,     ///< 2 vec(q), an angle: as Ceres, GTSAM and SE-Sync read files.
  kHalfAngles,  ///< vec(q), half of it: as g2o itself does.
};

/// What is minimised.
enum class Objective {
  kGeodesic,  ///< The residuals of Constraint with the whole information.
  kChordal,   ///< sum kappa |R_k - R_i R_ik|_F^2 + tau |t_k - t_i - R_i t_ik|^2, for which optima
              ///< can be certified [Rosen et al. 2019]; the file's information becomes two numbers.
};

/// Poses X_W and the constraints between them; the first one is fixed.
G2oGraph ToG2oGraph(const std::map<NodeId, Pose3>& X_W,
                    const std::map<int, Constraint>& constraints);

/// The pose graph of a file. Edges between vertices whose numbers differ by one are odometry, all
/// others closures. Edges without any information are left out. Fixed are the vertices that the
/// file fixes, and the first one of each connected part that has none.
PoseGraph ToPoseGraph(const G2oGraph& graph, const PoseGraphOptions& options,
                      RotationInformation rotation, Objective objective);

/// The vertices of each part of a graph that hangs together, the part with the smallest number
/// first.
std::vector<std::vector<NodeId>> ConnectedParts(const G2oGraph& graph);

/// The text of a .g2o file: vertices by number, what is fixed, edges. A planar graph is written in
/// two dimensions. Numbers read back exactly.
std::string ToG2oText(const G2oGraph& graph);

/// A .g2o file as it was read.
struct G2oFile {
  G2oGraph graph;
  std::vector<std::string> faults;     ///< What is wrong, a line each that names file and line.
  std::map<std::string, int> unknown;  ///< Tag -> lines that were left out for it.
  int comments = 0;
};

/// Reads the text of a .g2o file; `name` stands for it in messages. Lines that make no sense are
/// left out and told: text that is no number or not finite, a number too few or too many,
/// quaternions without unit norm, an information that is not positive semi-definite, vertices
/// twice, edges and FIX of vertices that are not there, two and three dimensions in one file.
G2oFile ParseG2o(std::string_view text, const std::string& name);

/// @throws UsageError with the first fault; SystemError when the file cannot be read.
G2oFile ReadG2o(const std::filesystem::path& path);

}  // namespace vog
