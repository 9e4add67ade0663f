#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "lib/geometry/voxel_grid.h"
#include "lib/registration/clouds_testing.h"

/// Random pieces of structures, as submaps see them, and what cannot be seen of their motions.
namespace vog {

/// In a frame S with z up, seen from about its origin.
struct Structure {
  std::vector<Vec3> points_S;
  /// Motions (right perturbations of S) that leave it as it is.
  std::vector<Vec6> unseen_S;
  Vec3 viewer_S = Vec3::Zero();
};

/// A turn around the axis through `center`.
inline Vec6 Turn(const Vec3& center, const Vec3& axis) {
  Vec6 xi;
  xi << center.cross(axis), axis;
  return xi;
}
inline Vec6 Shift(const Vec3& direction) {
  Vec6 xi;
  xi << direction, Vec3::Zero();
  return xi;
}

/// Makes structures of random size; points are spread over them, `kSpacing_m` apart.
class StructureMaker {
 public:
  explicit StructureMaker(Random random)
      : random_(random),
        distance_m_(random_.Uniform(1.5, 4)),
        half_height_m_(random_.Uniform(0.8, 2)),
        width_m_(random_.Uniform(2, 5)) {}

  Structure Wall() {
    AddWall(distance_m_);
    structure_.unseen_S = {Shift(kY), Shift(kZ), Turn(distance_m_ * kX, kX)};
    return structure_;
  }
  Structure Corridor() {
    AddWall(distance_m_);
    AddWall(-0.8 * distance_m_);
    structure_.unseen_S = {Shift(kY), Shift(kZ), Turn(Vec3::Zero(), kX)};
    return structure_;
  }
  Structure CorridorWithFloor() {
    Corridor();
    AddRectangle({-0.8 * distance_m_, -width_m_ / 2, -half_height_m_}, width_m_ * kY,
                 1.8 * distance_m_ * kX);
    structure_.unseen_S = {Shift(kY)};
    return structure_;
  }
  Structure Corner() {
    AddWall(distance_m_);
    AddRectangle({distance_m_ - width_m_, width_m_ / 2, -half_height_m_}, width_m_ * kX, Height());
    structure_.unseen_S = {Shift(kZ)};
    return structure_;
  }
  /// Two sides and the bottom, from below.
  Structure Box() {
    const double a = random_.Uniform(0.6, 1.5), b = random_.Uniform(0.6, 1.5);
    const Vec3 edge(distance_m_, 0, -half_height_m_);
    AddRectangle(edge, -a * kY, Height());
    AddRectangle(edge, b * kX, Height());
    AddRectangle(edge, b * kX, -a * kY);
    structure_.viewer_S = {0, 1.5, -half_height_m_ - 1.5};
    return structure_;
  }
  /// The near side of a pillar.
  Structure Cylinder() {
    const double radius_m = random_.Uniform(0.4, 1.5);
    const Vec3 center = (distance_m_ + radius_m) * kX;
    AddArc(center, -radius_m, 1.2);
    structure_.unseen_S = {Turn(center, kZ), Shift(kZ)};
    return structure_;
  }
  /// Two thin piles over a wide floor.
  Structure PilesOverFloor() {
    constexpr double kPile_m = 0.25, kFloor_m = 8;
    AddArc({distance_m_, -0.4 * width_m_, 0}, -kPile_m, 1.2);
    AddArc({distance_m_ + random_.Uniform(0, 1.5), 0.4 * width_m_, 0}, -kPile_m, 1.2);
    AddRectangle({-1, -kFloor_m / 2, -half_height_m_}, kFloor_m * kY, kFloor_m * kX);
    return structure_;
  }
  /// A piece of a round tank from inside.
  Structure TankWall() {
    const Vec3 center = -random_.Uniform(0, 2) * kX;
    AddArc(center, 3.5, 0.8);
    structure_.unseen_S = {Turn(center, kZ), Shift(kZ)};
    return structure_;
  }
  Structure Sphere() {
    const double radius_m = random_.Uniform(0.5, 1.5);
    const Vec3 center = (distance_m_ + radius_m) * kX;
    const int count = static_cast<int>(4 * radius_m * radius_m / (kSpacing_m * kSpacing_m));
    while (static_cast<int>(structure_.points_S.size()) < count) {
      Vec3 normal = random_.GaussianVector(Vec3::Ones()).normalized();
      normal.x() = -std::abs(normal.x());
      if (normal.x() < -0.25) structure_.points_S.push_back(center + radius_m * normal);
    }
    structure_.unseen_S = {Turn(center, kX), Turn(center, kY), Turn(center, kZ)};
    return structure_;
  }
  /// A blade of a propeller from above: a helicoid, which a screw leaves as it is.
  Structure Blade() {
    const double pitch_m = random_.Uniform(2, 4) / (2 * std::numbers::pi);
    const double inner_m = 0.5, outer_m = random_.Uniform(1.5, 3);
    const Vec3 axis = (distance_m_ + outer_m) * kX;
    const double area_m2 = 0.6 * (outer_m * outer_m - inner_m * inner_m);
    for (int i = 0; i < area_m2 / (kSpacing_m * kSpacing_m); ++i) {
      const double r = random_.Uniform(inner_m, outer_m), angle = random_.Uniform(-0.6, 0.6);
      structure_.points_S.push_back(
          axis + Vec3(-r * std::cos(angle), -r * std::sin(angle), pitch_m * angle));
    }
    structure_.viewer_S = axis + 2 * kZ;
    structure_.unseen_S = {Turn(axis, kZ) + Shift(pitch_m * kZ)};
    return structure_;
  }

 private:
  static constexpr double kSpacing_m = 0.04;
  inline static const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

  Vec3 Height() const { return 2 * half_height_m_ * kZ; }
  void AddRectangle(const Vec3& corner, const Vec3& along, const Vec3& up) {
    const auto points = SampleRectangles({{corner, along, up}}, kSpacing_m, random_);
    structure_.points_S.insert(structure_.points_S.end(), points.begin(), points.end());
    random_.Uniform(0, 1);  // The next one is another sample.
  }
  void AddWall(double x_m) {
    AddRectangle({x_m, -width_m_ / 2, -half_height_m_}, width_m_ * kY, Height());
  }
  /// A piece of an upright cylinder; a negative radius turns it around.
  void AddArc(const Vec3& center, double radius_m, double half_angle_rad) {
    const double area_m2 = 4 * half_angle_rad * std::abs(radius_m) * half_height_m_;
    for (int i = 0; i < area_m2 / (kSpacing_m * kSpacing_m); ++i) {
      const double angle = random_.Uniform(-half_angle_rad, half_angle_rad);
      structure_.points_S.push_back(center +
                                    Vec3(radius_m * std::cos(angle), radius_m * std::sin(angle),
                                         random_.Uniform(-half_height_m_, half_height_m_)));
    }
  }

  Random random_;
  double distance_m_, half_height_m_, width_m_;
  Structure structure_;
};

using MakeStructure = Structure (StructureMaker::*)();

/// Centres of the voxels that hold two points or more, without stray ones.
inline std::vector<Vec3> Voxelised(const std::vector<Vec3>& points, double voxel_size_m) {
  constexpr int kMinNeighbours = 3;
  const VoxelGrid grid(voxel_size_m);
  std::map<VoxelKey, int> counts;
  for (const Vec3& p : points) ++counts[grid.KeyOf(p)];
  std::erase_if(counts, [](const auto& voxel) { return voxel.second < 2; });
  std::vector<Vec3> centers;
  for (const auto& [key, count] : counts) {
    int neighbours = -1;
    for (int i = 0; i < 27; ++i)
      neighbours += static_cast<int>(
          counts.count({key.x + i % 3 - 1, key.y + i / 3 % 3 - 1, key.z + i / 9 - 1}));
    if (neighbours >= kMinNeighbours) centers.push_back(grid.CenterOf(key));
  }
  return centers;
}

/// The part of `motions` (combinations of them too) that keeps z, roll and pitch.
inline std::vector<Vec6> PlanarPartOf(const std::vector<Vec6>& motions) {
  if (motions.empty()) return {};
  Eigen::MatrixXd all(6, motions.size());
  for (std::size_t i = 0; i < motions.size(); ++i)
    all.col(static_cast<Eigen::Index>(i)) = motions[i];
  Eigen::FullPivLU<Eigen::MatrixXd> tilting(all.middleRows<3>(2));
  tilting.setThreshold(1e-9);
  std::vector<Vec6> planar;
  if (tilting.dimensionOfKernel() == 0) return planar;
  const Eigen::MatrixXd kept = all * tilting.kernel();
  for (Eigen::Index i = 0; i < kept.cols(); ++i) planar.push_back(kept.col(i));
  return planar;
}

}  // namespace vog
