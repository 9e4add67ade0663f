#include "lib/posegraph/chordal_start.h"

#include <Eigen/SVD>
#include <algorithm>

#include "lib/posegraph/block_cholesky.h"

namespace vog {
namespace {

/// Least squares over a graph, sum w |x_k - A_ik x_i - b_ik|^2, of kSize x 3 unknowns a node with
/// A_ik orthogonal.
template <int kSize>
class LinearGraph {
 public:
  using Block = Eigen::Matrix<double, kSize, kSize>;
  using Value = Eigen::Matrix<double, kSize, 3>;

  explicit LinearGraph(std::size_t nodes) : is_known_(nodes, false) {
    H_.diagonal.assign(nodes, Block::Zero());
    right_.setZero(kSize * static_cast<Eigen::Index>(nodes), 3);
  }

  /// @pre before any Add().
  void SetKnown(int node, const Value& value) {
    is_known_[static_cast<std::size_t>(node)] = true;
    H_.diagonal[static_cast<std::size_t>(node)].setIdentity();
    RightOf(node) = value;
  }

  void Add(int i, int k, double weight, const Block& A_ik, const Value& b_ik) {
    if (!IsKnown(i)) {
      H_.diagonal[static_cast<std::size_t>(i)] += weight * Block::Identity();
      RightOf(i) -= weight * A_ik.transpose() * b_ik;
      if (IsKnown(k)) RightOf(i) += weight * A_ik.transpose() * RightOf(k);
    }
    if (!IsKnown(k)) {
      H_.diagonal[static_cast<std::size_t>(k)] += weight * Block::Identity();
      RightOf(k) += weight * b_ik;
      if (IsKnown(i)) RightOf(k) += weight * A_ik * RightOf(i);
    }
    if (IsKnown(i) || IsKnown(k)) return;
    const auto [place, is_new] = blocks_.emplace(std::minmax(i, k), H_.blocks.size());
    if (is_new) {
      H_.places.push_back(place->first);
      H_.blocks.push_back(Block::Zero());
    }
    if (i < k) {
      H_.blocks[place->second] -= weight * A_ik.transpose();
    } else {
      H_.blocks[place->second] -= weight * A_ik;
    }
  }

  std::optional<Eigen::MatrixXd> Solve() const {
    constexpr double kSingularPivot = 1e-13;
    BlockCholesky<kSize> factor;
    if (!factor.Factor(H_) || factor.SmallestPivot() < kSingularPivot) return std::nullopt;
    return factor.Solve(right_);
  }

 private:
  bool IsKnown(int node) const { return is_known_[static_cast<std::size_t>(node)]; }
  auto RightOf(int node) { return right_.middleRows<kSize>(kSize * node); }

  std::vector<bool> is_known_;
  std::map<std::pair<int, int>, std::size_t> blocks_;
  BlockMatrix<kSize> H_;
  Eigen::MatrixXd right_;
};

Mat3 NearestRotation(const Mat3& M) {
  const Eigen::JacobiSVD<Mat3> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 signs(1, 1, 1);
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

struct Weights {
  double rotation, translation;
};

Weights WeightsOf(const Constraint& constraint) {
  const Mat6 information = constraint.Information();
  return {information.bottomRightCorner<3, 3>().trace() / 3,
          information.topLeftCorner<3, 3>().trace() / 3};
}

}  // namespace

std::optional<std::map<NodeId, Pose3>> ChordalStart(const PoseGraph& graph) {
  std::map<NodeId, int> index;
  for (const auto& [id, X_W] : graph.nodes()) index.emplace(id, static_cast<int>(index.size()));
  // R_Wk^T = R_ik^T R_Wi^T is linear in the transposed rotations.
  LinearGraph<3> rotations(index.size());
  for (const auto& [id, i] : index)
    if (graph.IsFixed(id)) rotations.SetKnown(i, graph.X_W(id).linear().transpose());
  for (const auto& [number, constraint] : graph.constraints())
    rotations.Add(index.at(constraint.from), index.at(constraint.to),
                  WeightsOf(constraint).rotation, constraint.X_ik.linear().transpose(),
                  Mat3::Zero());
  const auto R_WT = rotations.Solve();
  if (!R_WT) return std::nullopt;

  std::map<NodeId, Pose3> poses = graph.nodes();
  LinearGraph<1> translations(index.size());
  for (const auto& [id, i] : index) {
    Pose3& X_W = poses.at(id);
    if (graph.IsFixed(id)) {
      translations.SetKnown(i, X_W.translation().transpose());
    } else {
      X_W.linear() = NearestRotation(R_WT->middleRows<3>(3 * i).transpose());
    }
  }
  for (const auto& [number, constraint] : graph.constraints()) {
    const Vec3 step_W = poses.at(constraint.from).linear() * constraint.X_ik.translation();
    translations.Add(index.at(constraint.from), index.at(constraint.to),
                     WeightsOf(constraint).translation, Eigen::Matrix<double, 1, 1>::Identity(),
                     step_W.transpose());
  }
  const auto p_W = translations.Solve();
  if (!p_W) return std::nullopt;
  for (const auto& [id, i] : index) poses.at(id).translation() = p_W->row(i).transpose();
  return poses;
}

void StartFromTheBetter(PoseGraph& graph) {
  const auto start = ChordalStart(graph);
  if (!start) return;
  const std::map<NodeId, Pose3> before = graph.nodes();
  const double cost = graph.Cost();
  for (const auto& [id, X_W] : *start) graph.SetPose(id, X_W);
  if (graph.Cost() < cost) return;
  for (const auto& [id, X_W] : before) graph.SetPose(id, X_W);
}

}  // namespace vog
