#include "lib/posegraph/normal_equations.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

using Eigen::Quaterniond;

/// A part of H is made anew when what it depends on has changed by this share.
constexpr double kMaxChange = 1e-4;
/// Diagonal entries count as at least this much when they are damped.
constexpr double kLeastDamped = 1e-6;

NodeState Relative(const NodeState& X_Wi, const NodeState& X_Wk) {
  const Quaterniond q_iW = X_Wi.q.conjugate();
  return {q_iW * X_Wk.q, q_iW * Vec3(X_Wk.p - X_Wi.p)};
}

Quaterniond RotationError(const NodeState& X_ik, const NodeState& X_ik_now) {
  Quaterniond q_error = X_ik.q.conjugate() * X_ik_now.q;
  if (q_error.w() < 0) q_error.coeffs() = -q_error.coeffs();
  return q_error;
}

Vec6 ErrorFrom(const NodeState& X_ik, const NodeState& X_ik_now, const Quaterniond& q_error) {
  Vec6 error;
  error << X_ik.q.conjugate() * Vec3(X_ik_now.p - X_ik.p), 2 * q_error.vec();
  return error;
}

/// The derivatives of ErrorOf() by right perturbations of X_Wi and X_Wk.
struct Jacobians {
  Mat6 i = Mat6::Zero(), k = Mat6::Zero();
};

Jacobians JacobiansOf(const NodeState& X_ik, const NodeState& X_ik_now,
                      const Quaterniond& q_error) {
  const Mat3 R_ki = X_ik.q.conjugate().toRotationMatrix();
  const Mat3 w = q_error.w() * Mat3::Identity(), v = SkewOf(q_error.vec());
  Jacobians J;
  J.i.topLeftCorner<3, 3>() = -R_ki;
  J.i.topRightCorner<3, 3>() = R_ki * SkewOf(X_ik_now.p);
  J.i.bottomRightCorner<3, 3>() = (v - w) * R_ki;
  J.k.topLeftCorner<3, 3>() = R_ki * X_ik_now.q.toRotationMatrix();
  J.k.bottomRightCorner<3, 3>() = w + v;
  return J;
}

Vec3 UpOf(const NodeState& X_WB) { return X_WB.q.conjugate() * Vec3::UnitZ(); }

}  // namespace

NodeState NodeState::Moved(const Vec6& xi) const {
  const Quaterniond dq(1, xi[3] / 2, xi[4] / 2, xi[5] / 2);
  return {(q * dq).normalized(), p + q * xi.head<3>()};
}

Vec6 ErrorOf(const NodeState& X_ik, const NodeState& X_Wi, const NodeState& X_Wk) {
  const NodeState X_ik_now = Relative(X_Wi, X_Wk);
  return ErrorFrom(X_ik, X_ik_now, RotationError(X_ik, X_ik_now));
}

void NormalEquations::AddNode() {
  is_fixed_.push_back(false);
  is_changed_.push_back(true);
}

void NormalEquations::SetFixed(int node, bool is_fixed) {
  if (IsFixed(node) == is_fixed) return;
  is_fixed_[static_cast<std::size_t>(node)] = is_fixed;
  Touch(node);
  for (const auto& [number, term] : terms_)
    if (term.i == node || term.k == node) Touch(term);
}

void NormalEquations::AddConstraint(int number, int i, int k, const Constraint& constraint) {
  const auto [block, is_new] =
      blocks_.emplace(std::minmax(i, k), static_cast<std::size_t>(blocks_.size()));
  if (is_new) H_.places.push_back(block->first);
  RelativeTerm term;
  term.i = i;
  term.k = k;
  term.X_ik = NodeState::From(constraint.X_ik);
  term.information = constraint.Information();
  term.is_closure = constraint.kind != ConstraintKind::kOdometry;
  term.block = block->second;
  terms_.emplace(number, term);
}

void NormalEquations::RemoveConstraint(int number) {
  const auto found = terms_.find(number);
  if (found == terms_.end()) return;
  Touch(found->second);
  terms_.erase(found);
}

void NormalEquations::SetPrior(int node, const AbsolutePrior& prior) {
  PriorTerm& term = priors_[node];
  term.prior = prior;
  term.up_B_then.setZero();
  term.up_B = UpOf(NodeState::From(MakePose(Vec3::Zero(), {prior.roll_rad, prior.pitch_rad, 0})));
}

void NormalEquations::Touch(const RelativeTerm& term) {
  Touch(term.i);
  Touch(term.k);
}

DcsLoss NormalEquations::LossOf(const RelativeTerm& term) const {
  return term.is_closure ? closure_loss_ : DcsLoss();
}

Vec3 NormalEquations::PriorError(const PriorTerm& term, const NodeState& X_WB) {
  const Vec3 tilt = term.up_B.cross(UpOf(X_WB)) / term.prior.sigma_angle_rad;
  return {(X_WB.p.z() - term.prior.z_m) / term.prior.sigma_z_m, tilt.x(), tilt.y()};
}

double NormalEquations::CostAt(const NodeStates& states) const {
  const auto state = [&](int node) -> const NodeState& {
    return states[static_cast<std::size_t>(node)];
  };
  double cost = 0;
  for (const auto& [number, term] : terms_) {
    const Vec6 error = ErrorOf(term.X_ik, state(term.i), state(term.k));
    cost += LossOf(term).ValueOf(error.dot(term.information * error));
  }
  for (const auto& [node, term] : priors_) cost += PriorError(term, state(node)).squaredNorm();
  return cost;
}

double NormalEquations::Linearize(const NodeStates& states) {
  gradient_.setZero(6 * static_cast<Eigen::Index>(states.size()));
  double cost = 0;
  for (auto& [number, term] : terms_) cost += Linearize(states, term);
  for (auto& [node, term] : priors_)
    cost += Linearize(states[static_cast<std::size_t>(node)], node, term);
  for (std::size_t node = 0; node < states.size(); ++node)
    if (is_fixed_[node]) gradient_.segment<6>(6 * static_cast<Eigen::Index>(node)).setZero();
  return cost;
}

/// The Jacobians depend on X_ik alone. A change of its translation counts against its length, or
/// against the length at which the information of the rotation weighs as much.
bool NormalEquations::HasChanged(const RelativeTerm& term, const NodeState& X_ik, double weight) {
  if (std::abs(weight - term.weight) > kMaxChange) return true;
  if (2 * term.X_ik_then.q.angularDistance(X_ik.q) > kMaxChange) return true;
  const double translation = std::sqrt(term.information.topLeftCorner<3, 3>().trace());
  const double rotation = std::sqrt(term.information.bottomRightCorner<3, 3>().trace());
  return translation * (X_ik.p - term.X_ik_then.p).norm() >
         kMaxChange * (translation * X_ik.p.norm() + rotation);
}

double NormalEquations::Linearize(const NodeStates& states, RelativeTerm& term) {
  const NodeState X_ik =
      Relative(states[static_cast<std::size_t>(term.i)], states[static_cast<std::size_t>(term.k)]);
  const Quaterniond q_error = RotationError(term.X_ik, X_ik);
  const Vec6 error = ErrorFrom(term.X_ik, X_ik, q_error);
  const Vec6 weighed = term.information * error;
  const double s = error.dot(weighed), weight = LossOf(term).WeightOf(s);
  const Jacobians J = JacobiansOf(term.X_ik, X_ik, q_error);
  gradient_.segment<6>(6 * term.i) += weight * J.i.transpose() * weighed;
  gradient_.segment<6>(6 * term.k) += weight * J.k.transpose() * weighed;
  if (HasChanged(term, X_ik, weight)) {
    const Mat6 J_i_information = weight * J.i.transpose() * term.information;
    term.H_ii.noalias() = J_i_information * J.i;
    term.H_ik.noalias() = J_i_information * J.k;
    term.H_kk = weight * J.k.transpose() * term.information * J.k;
    term.X_ik_then = X_ik;
    term.weight = weight;
    Touch(term);
  }
  return LossOf(term).ValueOf(s);
}

double NormalEquations::Linearize(const NodeState& X_WB, int node, PriorTerm& term) {
  const Vec3 error = PriorError(term, X_WB), up_B = UpOf(X_WB);
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.topLeftCorner<1, 3>() = up_B.transpose() / term.prior.sigma_z_m;
  J.bottomRightCorner<2, 3>() =
      (SkewOf(term.up_B) * SkewOf(up_B)).topRows<2>() / term.prior.sigma_angle_rad;
  gradient_.segment<6>(6 * node) += J.transpose() * error;
  if ((up_B - term.up_B_then).norm() > kMaxChange) {
    term.H = J.transpose() * J;
    term.up_B_then = up_B;
    Touch(node);
  }
  return error.squaredNorm();
}

void NormalEquations::Assemble() {
  H_.diagonal.assign(is_fixed_.size(), Mat6::Zero());
  H_.blocks.assign(H_.places.size(), Mat6::Zero());
  for (const auto& [number, term] : terms_) {
    H_.diagonal[static_cast<std::size_t>(term.i)] += term.H_ii;
    H_.diagonal[static_cast<std::size_t>(term.k)] += term.H_kk;
    if (IsFixed(term.i) || IsFixed(term.k)) continue;
    if (term.i < term.k) {
      H_.blocks[term.block] += term.H_ik;
    } else {
      H_.blocks[term.block] += term.H_ik.transpose();
    }
  }
  for (const auto& [node, term] : priors_) H_.diagonal[static_cast<std::size_t>(node)] += term.H;
  for (std::size_t node = 0; node < is_fixed_.size(); ++node)
    if (is_fixed_[node]) H_.diagonal[node].setIdentity();
}

bool NormalEquations::Factor(double damping) {
  if (damping != 0 || damping_ != 0) is_changed_.assign(is_changed_.size(), true);
  if (std::find(is_changed_.begin(), is_changed_.end(), true) == is_changed_.end()) return true;
  Assemble();
  if (damping != 0) {
    for (Mat6& block : H_.diagonal)
      block.diagonal() += damping * block.diagonal().cwiseMax(kLeastDamped);
  }
  damping_ = damping;
  if (!factor_.Factor(H_, is_changed_)) return false;
  is_changed_.assign(is_changed_.size(), false);
  return true;
}

double NormalEquations::PredictedDecrease(const Eigen::VectorXd& step) const {
  double damped = 0;
  if (damping_ != 0) {
    for (std::size_t node = 0; node < H_.diagonal.size(); ++node) {
      const Vec6 damped_diagonal = H_.diagonal[node].diagonal();
      const auto part = step.segment<6>(6 * static_cast<Eigen::Index>(node));
      damped += damping_ / (1 + damping_) * damped_diagonal.dot(part.cwiseAbs2());
    }
  }
  return damped - gradient_.dot(step);
}

}  // namespace vog
