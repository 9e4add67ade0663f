#pragma once

#include <Eigen/Geometry>
#include <numbers>

namespace vog {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// X_AB, the pose of frame B in frame A: p_A = X_AB * p_B. Letters that touch must match,
/// X_WB * X_BS = X_WS. Frames: W world (z up), B body (x forward, y left, z up), S sonar (x along
/// the fan's centre line, the fan in its x-y plane), M a submap, O the odometry's own world.
using Pose3 = Eigen::Isometry3d;

constexpr double ToRadians(double degrees) { return degrees * std::numbers::pi / 180; }
constexpr double ToDegrees(double radians) { return radians * 180 / std::numbers::pi; }

/// Roll, pitch and yaw [rad], R = Rz(yaw) Ry(pitch) Rx(roll).
struct RollPitchYaw {
  double roll = 0, pitch = 0, yaw = 0;
};

Pose3 MakePose(const Vec3& position_m, const RollPitchYaw& angles = {});
Pose3 MakePose(const Vec3& position_m, const Eigen::Quaterniond& orientation);

RollPitchYaw AnglesOf(const Pose3& X_AB);
double YawOf(const Pose3& X_AB);

/// The pose laid into the plane z = 0: its x, y and yaw alone.
Pose3 Level(const Pose3& X_AB);

/// An angle [rad] in (-pi, pi].
double WrapAngle(double angle);

/// The motion from A to B seen from A: X_WA^-1 * X_WB.
Pose3 Ominus(const Pose3& X_WA, const Pose3& X_WB);

/// The exponential map of SE(3); `xi` = (x, y, z, roll, pitch, yaw), translation first. A pose is
/// perturbed on the right, X * Exp(xi), and so are all covariances of poses [Barfoot 2017, 7.1].
Pose3 Exp(const Vec6& xi);
/// Its inverse; the rotation part has a norm of at most pi.
Vec6 Log(const Pose3& X);

/// Ad(X) with X * Exp(xi) = Exp(Ad(X) * xi) * X, in the order of Exp().
Mat6 AdjointOf(const Pose3& X);

Mat3 SkewOf(const Vec3& v);

/// On the straight line and the shortest rotation from `X_WA` (fraction 0) to `X_WB` (fraction 1).
Pose3 Interpolate(const Pose3& X_WA, const Pose3& X_WB, double fraction);

}  // namespace vog
