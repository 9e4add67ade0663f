#include "lib/posegraph/residual.h"

namespace vog {

RelativeError ErrorOf(const Constraint& constraint, const Pose3& X_Wi, const Pose3& X_Wk) {
  const Mat3 R_ki(constraint.X_ik.inverse().linear());  // As measured.
  const Pose3 X_ik = Ominus(X_Wi, X_Wk);
  const Mat3 R_error = R_ki * X_ik.linear();
  const Vec3 p_ik = X_ik.translation();
  Eigen::Quaterniond q_error(R_error);
  if (q_error.w() < 0) q_error.coeffs() = -q_error.coeffs();
  const Mat3 wI = q_error.w() * Mat3::Identity(), v_cross = SkewOf(q_error.vec());

  RelativeError e;
  e.error << R_ki * (p_ik - constraint.X_ik.translation()), 2 * q_error.vec();
  e.by_i << -R_ki, R_ki * SkewOf(p_ik), Mat3::Zero(), -(wI - v_cross) * R_ki;
  e.by_k << R_error, Mat3::Zero(), Mat3::Zero(), wI + v_cross;
  return e;
}

AbsoluteError ErrorOf(const AbsolutePrior& prior, const Pose3& X_W) {
  const Vec3 up_B = X_W.linear().transpose() * Vec3::UnitZ();
  const Vec3 measured_up_B =
      MakePose(Vec3::Zero(), {prior.roll_rad, prior.pitch_rad, 0}).linear().transpose() *
      Vec3::UnitZ();
  const Mat3 tilt_by_up = SkewOf(measured_up_B) / prior.sigma_angle_rad;

  AbsoluteError e;
  e.residual << (X_W.translation().z() - prior.z_m) / prior.sigma_z_m,
      (tilt_by_up * up_B).head<2>();
  e.by_pose.setZero();
  e.by_pose.topLeftCorner<1, 3>() = up_B.transpose() / prior.sigma_z_m;
  e.by_pose.bottomRightCorner<2, 3>() = (tilt_by_up * SkewOf(up_B)).topRows<2>();
  return e;
}

Pose3 Perturbed(const Pose3& X, const Vec6& xi) {
  const Eigen::Quaterniond dq(1, xi[3] / 2, xi[4] / 2, xi[5] / 2);
  return MakePose(X * Vec3(xi.head<3>()), Eigen::Quaterniond(X.linear()) * dq);
}

}  // namespace vog
