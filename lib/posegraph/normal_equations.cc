#include "lib/posegraph/normal_equations.h"

#include <algorithm>

#include "lib/posegraph/residual.h"

namespace vog {

NodeRows::NodeRows(const GraphData& graph) {
  for (const auto& [id, X_W] : graph.nodes)
    if (!graph.IsFixed(id)) Append(id);
}

void NodeRows::Append(NodeId id) {
  row_of_.emplace(id, size());
  ids_.push_back(id);
}

std::optional<int> NodeRows::Of(NodeId id) const {
  const auto row = row_of_.find(id);
  return row == row_of_.end() ? std::nullopt : std::optional(row->second);
}

NormalEquations::NormalEquations(const GraphData& graph, const NodeRows& rows)
    : rows_(static_cast<std::size_t>(rows.size())) {
  for (const auto& [number, c] : graph.constraints)
    terms_.push_back(
        {&c, &graph.nodes.at(c.from), &graph.nodes.at(c.to), rows.Of(c.from), rows.Of(c.to)});
  for (const auto& [id, prior] : graph.priors)
    priors_.push_back({&prior, &graph.nodes.at(id), rows.Of(id)});
}

NormalEquations::Right NormalEquations::Evaluate() const {
  Right right;
  right.gradient.setZero(6 * static_cast<Eigen::Index>(rows_));
  const auto gradient = [&](int row) { return right.gradient.segment<6>(6 * row); };
  for (const Term& term : terms_) {
    const RelativeError e = ErrorOf(*term.constraint, *term.X_Wi, *term.X_Wk);
    const Residual residual = term.constraint->whitening * e.error;
    const Vec6 by_error = term.constraint->whitening.transpose() * residual;
    right.cost += residual.squaredNorm();
    if (term.i) gradient(*term.i) += e.by_i.transpose() * by_error;
    if (term.k) gradient(*term.k) += e.by_k.transpose() * by_error;
  }
  for (const PriorTerm& term : priors_) {
    const AbsoluteError e = ErrorOf(*term.prior, *term.X_W);
    right.cost += e.residual.squaredNorm();
    if (term.row) gradient(*term.row) += e.by_pose.transpose() * e.residual;
  }
  return right;
}

BlockMatrix<6> NormalEquations::Hessian() const {
  BlockMatrix<6> H;
  H.diagonal.assign(rows_, Mat6::Zero());
  for (const Term& term : terms_)
    if (term.i && term.k) H.places.push_back(std::minmax(*term.i, *term.k));
  std::sort(H.places.begin(), H.places.end());
  H.places.erase(std::unique(H.places.begin(), H.places.end()), H.places.end());
  H.blocks.assign(H.places.size(), Mat6::Zero());
  for (const Term& term : terms_) {
    const RelativeError e = ErrorOf(*term.constraint, *term.X_Wi, *term.X_Wk);
    const Whitening J_i = term.constraint->whitening * e.by_i;
    const Whitening J_k = term.constraint->whitening * e.by_k;
    if (term.i) H.diagonal[static_cast<std::size_t>(*term.i)] += J_i.transpose() * J_i;
    if (term.k) H.diagonal[static_cast<std::size_t>(*term.k)] += J_k.transpose() * J_k;
    if (!term.i || !term.k) continue;
    const std::pair<int, int> place = std::minmax(*term.i, *term.k);
    const auto block = std::lower_bound(H.places.begin(), H.places.end(), place) - H.places.begin();
    const bool is_upper = *term.i < *term.k;
    H.blocks[static_cast<std::size_t>(block)] +=
        is_upper ? J_i.transpose() * J_k : J_k.transpose() * J_i;
  }
  for (const PriorTerm& term : priors_) {
    if (!term.row) continue;
    const AbsoluteError e = ErrorOf(*term.prior, *term.X_W);
    H.diagonal[static_cast<std::size_t>(*term.row)] += e.by_pose.transpose() * e.by_pose;
  }
  return H;
}

}  // namespace vog
