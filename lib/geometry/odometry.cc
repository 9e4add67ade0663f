#include "lib/geometry/odometry.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>

namespace vog {
namespace {

constexpr std::array<int, 3> kPlanar = {0, 1, 5};  // x, y, yaw.

}  // namespace

Mat3 DriftOptions::StepCovariance(double step_s) const {
  const double scale = scaling == DriftScaling::kLiteral ? step_s * step_s : step_s;
  return Vec3(scale * Vec3(variance_x_m2_s, variance_y_m2_s, variance_yaw_rad2_s)).asDiagonal();
}

Mat3 PlanarAdjointOf(const Pose3& X) {
  const double yaw = YawOf(X);
  Mat3 Ad;
  Ad << std::cos(yaw), -std::sin(yaw), X.translation().y(),  //
      std::sin(yaw), std::cos(yaw), -X.translation().x(),    //
      0, 0, 1;
  return Ad;
}

Mat6 PlanarTo6(const Mat3& planar) {
  Mat6 covariance = Mat6::Zero();
  covariance(kPlanar, kPlanar) = planar;
  return covariance;
}

Mat3 PlanarOf(const Mat6& full) { return full(kPlanar, kPlanar); }

double HorizontalSigma(const Mat6& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance.topLeftCorner<2, 2>());
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

Mat3 ComposePlanarCovariance(const Mat3& covariance_AB, const Pose3& X_BC,
                             const Mat3& covariance_BC) {
  const Mat3 Ad_CB = PlanarAdjointOf(X_BC.inverse());
  return Ad_CB * covariance_AB * Ad_CB.transpose() + covariance_BC;
}

Mat3 MotionCovariance(const OdometrySample& from, const OdometrySample& to) {
  const Mat3 Ad = PlanarAdjointOf(Ominus(to.X_OB, from.X_OB));
  const Mat3 added = to.covariance - Ad * from.covariance * Ad.transpose();
  // The difference of two rounded numbers may come out slightly negative.
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(0.5 * (added + added.transpose()));
  const Mat3 V = solver.eigenvectors();
  return V * solver.eigenvalues().cwiseMax(0).asDiagonal() * V.transpose();
}

void OdometryHistory::Add(const OdometrySample& sample) {
  if (!samples_.empty() && samples_.back().segment != sample.segment) samples_.clear();
  samples_.push_back(sample);
}

std::optional<OdometrySample> OdometryHistory::At(Time time) const {
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), time,
                       [](const OdometrySample& sample, Time t) { return sample.time < t; });
  if (after == samples_.end()) return std::nullopt;
  if (after->time == time) return *after;
  if (after == samples_.begin()) return std::nullopt;
  const OdometrySample& a = *std::prev(after);
  const OdometrySample& b = *after;
  if (b.time - a.time > kLongestGap) return std::nullopt;
  const double fraction = ToSeconds(time - a.time) / ToSeconds(b.time - a.time);
  OdometrySample sample = a;
  sample.time = time;
  sample.X_OB = Interpolate(a.X_OB, b.X_OB, fraction);
  sample.covariance += fraction * (b.covariance - a.covariance);
  sample.velocity_B_m_s += fraction * (b.velocity_B_m_s - a.velocity_B_m_s);
  sample.yaw_rate_rad_s += fraction * (b.yaw_rate_rad_s - a.yaw_rate_rad_s);
  return sample;
}

void OdometryHistory::ForgetBefore(Time time) {
  while (samples_.size() > 1 && samples_[1].time <= time) samples_.pop_front();
}

}  // namespace vog
