#include "lib/geometry/pose.h"

#include <cmath>
#include <numbers>

namespace vog {
namespace {

constexpr double kSmallAngle_rad = 1e-6;

/// The left Jacobian of SO(3), which maps the translation part of a twist to a translation.
Mat3 LeftJacobian(const Vec3& phi) {
  const double angle = phi.norm();
  const Mat3 S = SkewOf(phi);
  if (angle < kSmallAngle_rad) return Mat3::Identity() + 0.5 * S;
  const double a2 = angle * angle;
  return Mat3::Identity() + (1 - std::cos(angle)) / a2 * S +
         (angle - std::sin(angle)) / (a2 * angle) * S * S;
}

}  // namespace

Pose3 MakePose(const Vec3& position_m, const RollPitchYaw& angles) {
  return MakePose(position_m, Eigen::Quaterniond(Eigen::AngleAxisd(angles.yaw, Vec3::UnitZ()) *
                                                 Eigen::AngleAxisd(angles.pitch, Vec3::UnitY()) *
                                                 Eigen::AngleAxisd(angles.roll, Vec3::UnitX())));
}

Pose3 MakePose(const Vec3& position_m, const Eigen::Quaterniond& orientation) {
  Pose3 X = Pose3::Identity();
  X.linear() = orientation.normalized().toRotationMatrix();
  X.translation() = position_m;
  return X;
}

RollPitchYaw AnglesOf(const Pose3& X_AB) {
  const Mat3 R = X_AB.linear();
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
          std::atan2(R(1, 0), R(0, 0))};
}

double YawOf(const Pose3& X_AB) { return std::atan2(X_AB(1, 0), X_AB(0, 0)); }

Pose3 Level(const Pose3& X_AB) {
  return MakePose({X_AB.translation().x(), X_AB.translation().y(), 0}, {0, 0, YawOf(X_AB)});
}

double WrapAngle(double angle) {
  const double wrapped = std::remainder(angle, 2 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

Pose3 Ominus(const Pose3& X_WA, const Pose3& X_WB) { return X_WA.inverse() * X_WB; }

Pose3 Exp(const Vec6& xi) {
  const Vec3 phi = xi.tail<3>();
  const double angle = phi.norm();
  Pose3 X = Pose3::Identity();
  if (angle > 0) X.linear() = Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix();
  X.translation() = LeftJacobian(phi) * xi.head<3>();
  return X;
}

Vec6 Log(const Pose3& X) {
  // Through the quaternion, which stays exact near 0 and near pi.
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double scale = sine < 1e-12 ? 2.0 : 2 * std::atan2(sine, q.w()) / sine;
  const Vec3 phi = scale * q.vec();
  Vec6 xi;
  xi << LeftJacobian(phi).inverse() * X.translation(), phi;
  return xi;
}

Mat6 AdjointOf(const Pose3& X) {
  Mat6 Ad = Mat6::Zero();
  Ad.topLeftCorner<3, 3>() = X.linear();
  Ad.bottomRightCorner<3, 3>() = X.linear();
  Ad.topRightCorner<3, 3>() = SkewOf(X.translation()) * X.linear();
  return Ad;
}

Mat3 SkewOf(const Vec3& v) {
  Mat3 S;
  S << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return S;
}

Pose3 Interpolate(const Pose3& X_WA, const Pose3& X_WB, double fraction) {
  const Eigen::Quaterniond q_WA(X_WA.linear()), q_WB(X_WB.linear());
  return MakePose((1 - fraction) * X_WA.translation() + fraction * X_WB.translation(),
                  q_WA.slerp(fraction, q_WB));
}

}  // namespace vog
