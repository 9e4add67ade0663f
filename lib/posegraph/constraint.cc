#include "lib/posegraph/constraint.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
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

double ChiSquare99(int degrees) {
  constexpr std::array<double, 7> kLimit = {0, 6.635, 9.210, 11.345, 13.277, 15.086, 16.812};
  return kLimit.at(static_cast<std::size_t>(degrees));
}

}  // namespace vog
