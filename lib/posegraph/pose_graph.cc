#include "lib/posegraph/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace vog {
namespace {

/// Pivots below this share of their diagonal entry are rounding errors: a pose is free.
constexpr double kSingularPivot = 1e-14;
/// A decrease of the cost, which has no unit, that is nothing to anybody.
constexpr double kNoDecrease = 1e-15;
/// A step with the factor of before, which costs little, is taken when it promises to leave a cost
/// that falls this much slower.
constexpr double kChordGain = 0.1;

/// The damping of Levenberg and Marquardt, none as long as all goes well.
class Damping {
 public:
  double value() const { return value_; }
  bool IsHopeless() const { return value_ > 1e12; }
  void Raise() { value_ = std::max(4 * value_, 1e-4); }
  /// After a step whose decrease was this share of the predicted one.
  void Adapt(double share) {
    if (share < 0.25) {
      Raise();
    } else if (share > 0.75) {
      value_ = value_ > 1e-7 ? value_ / 10 : 0;
    }
  }

 private:
  double value_ = 0;
};

NodeStates Moved(const NodeStates& states, const Eigen::VectorXd& step) {
  NodeStates moved;
  moved.reserve(states.size());
  for (const NodeState& state : states)
    moved.push_back(state.Moved(step.segment<6>(6 * static_cast<Eigen::Index>(moved.size()))));
  return moved;
}

}  // namespace

void PoseGraph::AddNode(NodeId id, const Pose3& X_W) {
  if (!nodes_.emplace(id, X_W).second)
    throw std::invalid_argument("node " + std::to_string(id) + " is already in the graph");
  index_.emplace(id, static_cast<int>(index_.size()));
  equations_.AddNode();
}

void PoseGraph::SetPrior(NodeId id, const AbsolutePrior& prior) {
  equations_.SetPrior(index_.at(id), prior);
}

int PoseGraph::AddConstraint(const Constraint& constraint) {
  if (!nodes_.count(constraint.from) || !nodes_.count(constraint.to))
    throw std::invalid_argument("a constraint needs both its nodes in the graph");
  constraints_.emplace(next_constraint_, constraint);
  equations_.AddConstraint(next_constraint_, index_.at(constraint.from), index_.at(constraint.to),
                           constraint);
  return next_constraint_++;
}

void PoseGraph::RemoveConstraint(int number) {
  constraints_.erase(number);
  equations_.RemoveConstraint(number);
}

NodeStates PoseGraph::States() const {
  NodeStates states(nodes_.size());
  for (const auto& [id, X_W] : nodes_)
    states[static_cast<std::size_t>(index_.at(id))] = NodeState::From(X_W);
  return states;
}

void PoseGraph::HoldFixedNodes() const {
  for (const auto& [id, index] : index_) equations_.SetFixed(index, IsFixed(id));
}

SolveSummary PoseGraph::Solve(DcsLoss closure_loss) {
  HoldFixedNodes();
  equations_.SetLoss(closure_loss);
  NodeStates states = States();
  const double cost = equations_.Linearize(states);
  SolveSummary summary{std::isfinite(cost), cost, cost, 0};
  if (!summary.usable || !Descend(states, summary)) return summary;
  for (auto& [id, X_W] : nodes_)
    if (!IsFixed(id)) X_W = states[static_cast<std::size_t>(index_.at(id))].ToPose();
  return summary;
}

bool PoseGraph::Descend(NodeStates& states, SolveSummary& summary) {
  double& cost = summary.final_cost;
  Damping damping;
  double last_decrease = 0;  // 0: the next step needs a new factor.
  while (summary.iterations < options_.max_iterations && !damping.IsHopeless()) {
    Eigen::VectorXd step;
    if (last_decrease > 0) step = equations_.Step();
    const bool is_chord =
        last_decrease > 0 && equations_.PredictedDecrease(step) < kChordGain * last_decrease;
    if (!is_chord) {
      if (!equations_.Factor(damping.value())) {
        damping.Raise();
        summary.usable = !damping.IsHopeless();
        continue;
      }
      step = equations_.Step();
    }
    ++summary.iterations;
    const double predicted = equations_.PredictedDecrease(step);
    const double enough = std::max(options_.function_tolerance * cost, kNoDecrease);
    NodeStates moved = Moved(states, step);
    const double decrease = cost - equations_.CostAt(moved);
    if (decrease > 0) {
      states = std::move(moved);
      cost = equations_.Linearize(states);
      if (!is_chord) damping.Adapt(decrease / predicted);
      last_decrease = damping.value() == equations_.damping() ? decrease : 0;
      if (decrease <= enough) break;
    } else {
      if (predicted <= enough) break;
      if (!is_chord) damping.Raise();
      last_decrease = 0;
    }
  }
  return summary.usable;
}

double PoseGraph::Cost() const {
  equations_.SetLoss({});
  return equations_.CostAt(States());
}

double PoseGraph::ChiSquareOf(const Constraint& constraint) const {
  const Vec6 error =
      ErrorOf(NodeState::From(constraint.X_ik), NodeState::From(X_W(constraint.from)),
              NodeState::From(X_W(constraint.to)));
  return (constraint.whitening * error).squaredNorm();
}

std::vector<Mat6> PoseGraph::RelativeCovariances(
    const std::vector<std::pair<NodeId, NodeId>>& pairs) const {
  HoldFixedNodes();
  equations_.SetLoss({});
  equations_.Linearize(States());
  if (!equations_.Factor(0) || equations_.factor().SmallestPivot() < kSingularPivot) return {};
  const std::vector<Mat6> diagonal = equations_.factor().InverseDiagonal();
  std::map<NodeId, Eigen::MatrixXd> columns;  // Of the inverse, six a node.
  const auto marginal = [&](NodeId id) -> Mat6 {
    return IsFixed(id) ? Mat6::Zero() : diagonal[static_cast<std::size_t>(index_.at(id))];
  };
  const auto cross = [&](NodeId row, NodeId column) -> Mat6 {
    if (IsFixed(row) || IsFixed(column)) return Mat6::Zero();
    Eigen::MatrixXd& solved = columns[column];
    if (solved.size() == 0) {
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(6 * static_cast<int>(nodes_.size()), 6);
      unit.middleRows<6>(6 * index_.at(column)).setIdentity();
      solved = equations_.factor().Solve(unit);
    }
    return solved.middleRows<6>(6 * index_.at(row));
  };
  std::vector<Mat6> covariances;
  for (const auto& [i, k] : pairs) {
    if (i == k) {
      covariances.push_back(Mat6::Zero());
      continue;
    }
    // X_ik Exp(xi) with xi = xi_k - Ad(X_ik^-1) xi_i.
    const Mat6 A = AdjointOf(Ominus(X_W(k), X_W(i)));
    const Mat6 P_ik = A * cross(i, k);
    covariances.push_back(marginal(k) + A * marginal(i) * A.transpose() - P_ik - P_ik.transpose());
  }
  return covariances;
}

}  // namespace vog
