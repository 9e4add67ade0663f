#include "lib/posegraph/constraint.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <stdexcept>

namespace vog {

Whitening WhiteningOf(const Mat6& covariance) {
  return PartialWhiteningOf(Mat6::Identity(), covariance);
}

Whitening PartialWhiteningOf(const Eigen::Matrix<double, 6, Eigen::Dynamic>& basis,
                             const Mat6& covariance) {
  const Eigen::MatrixXd projected = basis.transpose() * covariance * basis;
  const Eigen::LLT<Eigen::MatrixXd> llt(projected);
  if (llt.info() != Eigen::Success)
    throw std::invalid_argument("the covariance of a constraint is not positive definite");
  return llt.matrixL().solve(Eigen::MatrixXd(basis.transpose()));
}

Whitening WhiteningOfInformation(const Mat6& information) {
  constexpr double kRankTolerance = 1e-13;  // Of the largest eigenvalue.
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(information);
  const Vec6& values = eigen.eigenvalues();  // Ascending.
  const auto rank = (values.array() > kRankTolerance * values[5]).count();
  return values.tail(rank).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().rightCols(rank).transpose();
}

}  // namespace vog
