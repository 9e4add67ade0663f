#include "lib/posegraph/g2o.h"

#include "lib/base/files.h"

namespace vog {
namespace {

void AppendPose(const Pose3& X, std::string& line) {
  for (const double number : X.translation()) line += " " + ToText(number);
  const Eigen::Vector4d q = Eigen::Quaterniond(X.linear()).coeffs();
  for (const double number : q) line += " " + ToText(number);
}

}  // namespace

G2oGraph ToG2oGraph(const PoseGraph& graph) {
  G2oGraph g2o{graph.nodes(), {}};
  for (const auto& [number, constraint] : graph.constraints())
    g2o.edges.push_back(
        {constraint.from, constraint.to, constraint.X_ik, constraint.Information()});
  return g2o;
}

std::string ToG2oText(const G2oGraph& graph) {
  std::string text;
  for (const auto& [id, X_W] : graph.vertices) {
    text += "VERTEX_SE3:QUAT " + std::to_string(id);
    AppendPose(X_W, text);
    text += "\n";
  }
  if (!graph.vertices.empty())
    text += "FIX " + std::to_string(graph.vertices.begin()->first) + "\n";
  for (const G2oEdge& edge : graph.edges) {
    text += "EDGE_SE3:QUAT " + std::to_string(edge.from) + " " + std::to_string(edge.to);
    AppendPose(edge.X_ik, text);
    for (int row = 0; row < 6; ++row)
      for (int col = row; col < 6; ++col) text += " " + ToText(edge.information(row, col));
    text += "\n";
  }
  return text;
}

}  // namespace vog
