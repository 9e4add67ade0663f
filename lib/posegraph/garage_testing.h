#pragma once

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "lib/base/random.h"
#include "lib/posegraph/pose_graph.h"

namespace vog {

/// A drive up a spiral of several floors and down again, so that each place is passed twice. What
/// is measured has noise as large as its covariance says.
class Garage {
 public:
  Garage(int floors, std::uint64_t seed) : random_(seed, "garage") {
    constexpr int kPerFloor = 40;
    const int up = floors * kPerFloor;
    for (int i = 0; i < 2 * up; ++i) {
      const int height = i < up ? i : 2 * up - 1 - i;
      const double angle = 2 * std::numbers::pi * height / kPerFloor;
      truth_.push_back(
          MakePose({15 * std::cos(angle), 15 * std::sin(angle), 3.0 * height / kPerFloor},
                   {0, 0, angle + (i < up ? 0.5 : -0.5) * std::numbers::pi}));
    }
  }

  const std::vector<Pose3>& truth() const { return truth_; }

  /// The nodes at odometry's poses, and odometry. Constraints state covariances `pessimism` times
  /// those of their noise.
  PoseGraph Odometry(double pessimism = 1) {
    pessimism_ = pessimism;
    PoseGraph graph({100, 1e-8});
    graph.AddNode(0, truth_[0]);
    for (int i = 1; i < size(); ++i) {
      const Constraint step = Measure(i - 1, i, ConstraintKind::kOdometry);
      graph.AddNode(i, graph.X_W(i - 1) * step.X_ik);
      graph.AddConstraint(step);
    }
    return graph;
  }

  /// Between two passes of one place.
  Constraint RightClosure() {
    const int i = random_.Index(size() / 2 - 10);
    return Measure(i, size() - 1 - i - random_.Index(3), ConstraintKind::kFullClosure);
  }

  /// Between any two nodes, some place in the garage.
  Constraint WrongClosure() {
    const int i = random_.Index(size()), k = (i + 2 + random_.Index(size() - 3)) % size();
    Constraint closure = Measure(i, k, ConstraintKind::kFullClosure);
    closure.X_ik =
        MakePose({random_.Uniform(-30, 30), random_.Uniform(-30, 30), random_.Uniform(-5, 5)},
                 {0, 0, random_.Uniform(-std::numbers::pi, std::numbers::pi)});
    return closure;
  }

 private:
  int size() const { return static_cast<int>(truth_.size()); }

  Constraint Measure(int i, int k, ConstraintKind kind) {
    Vec6 sigma, noise;
    sigma << 0.02, 0.02, 0.01, 0.001, 0.001, 0.003;
    for (int d = 0; d < 6; ++d) noise[d] = random_.Gaussian(sigma[d]);
    const Mat6 covariance = pessimism_ * Mat6(sigma.cwiseAbs2().asDiagonal());
    return {i, k, kind,
            Ominus(truth_[static_cast<std::size_t>(i)], truth_[static_cast<std::size_t>(k)]) *
                Exp(noise),
            WhiteningOf(covariance)};
  }

  Random random_;
  double pessimism_ = 1;
  std::vector<Pose3> truth_;
};

}  // namespace vog
