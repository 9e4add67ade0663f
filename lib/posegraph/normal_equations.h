#pragma once

#include <cstddef>
#include <optional>
#include <unordered_map>
#include <vector>

#include "lib/posegraph/block_cholesky.h"
#include "lib/posegraph/graph_data.h"

namespace vog {

/// Where the free nodes of a graph stand in vectors and matrices, six numbers each.
class NodeRows {
 public:
  /// By number.
  explicit NodeRows(const GraphData& graph);
  NodeRows() = default;

  void Append(NodeId id);
  /// Nothing for a fixed node.
  std::optional<int> Of(NodeId id) const;
  const std::vector<NodeId>& ids() const { return ids_; }
  int size() const { return static_cast<int>(ids_.size()); }

 private:
  std::vector<NodeId> ids_;
  std::unordered_map<NodeId, int> row_of_;
};

/// The least squares problem of a graph at the poses that it has when it is asked: r the residuals,
/// J their derivatives by the perturbations of the free nodes' poses.
class NormalEquations {
 public:
  /// Both must stay, and keep their nodes and constraints. `rows` must have all free nodes.
  NormalEquations(const GraphData& graph, const NodeRows& rows);

  struct Right {
    double cost = 0;           ///< r^T r.
    Eigen::VectorXd gradient;  ///< J^T r.
  };
  Right Evaluate() const;
  /// J^T J.
  BlockMatrix<6> Hessian() const;

 private:
  struct Term {
    const Constraint* constraint;
    const Pose3 *X_Wi, *X_Wk;
    std::optional<int> i, k;
  };
  struct PriorTerm {
    const AbsolutePrior* prior;
    const Pose3* X_W;
    std::optional<int> row;
  };

  std::size_t rows_;
  std::vector<Term> terms_;
  std::vector<PriorTerm> priors_;
};

}  // namespace vog
