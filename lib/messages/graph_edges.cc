#include "lib/messages/graph_edges.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "lib/messages/convert.h"

namespace vog {
namespace {

/// The directions in which a block of a projection is more than half there. A mixture of motions
/// is none of either kind.
std::vector<Vec3> DirectionsOf(const Mat3& projection) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(projection);
  std::vector<Vec3> directions;
  for (int i = 2; i >= 0; --i) {
    if (solver.eigenvalues()[i] > 0.5) directions.push_back(solver.eigenvectors().col(i));
  }
  return directions;
}

}  // namespace

FreeMotions FreeMotionsOf(const graph_edge_t& edge) {
  if (edge.kind != graph_edge_t::PARTIAL_CLOSURE) return {};
  // What is not bound has no information; what is, has much.
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(MatrixFrom<6>(edge.information));
  const int count = std::clamp(6 - static_cast<int>(edge.directions), 0, 6);
  const auto free = solver.eigenvectors().leftCols(count);
  const Mat6 projection = free * free.transpose();
  return {DirectionsOf(projection.topLeftCorner<3, 3>()),
          DirectionsOf(projection.bottomRightCorner<3, 3>())};
}

}  // namespace vog
