#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <numbers>
#include <string>

#include "lib/registration/icp.h"
#include "lib/registration/structures_testing.h"

namespace vog {
namespace {

constexpr double kVoxel_m = 0.095;
constexpr double kPi = std::numbers::pi;

/// Two submaps of one structure, with noise along the rays, and where to begin.
struct Pair {
  Pair(const Structure& structure, IcpFreedom freedom, double noise_m, Random& random)
      : is_planar(freedom == IcpFreedom::kPlanar),
        X_ik(AnyPose(random)),
        X_iS(AnyPose(random)),
        X_kS(X_ik.inverse() * X_iS),
        initial_X_ik(X_ik * RandomMotion(is_planar ? Twist(0.25, 0.25, 0, 0, 0, 0.08)
                                                   : Twist(0.2, 0.2, 0.15, 0.04, 0.04, 0.06),
                                         random)),
        unseen_S(is_planar ? PlanarPartOf(structure.unseen_S) : structure.unseen_S) {
    std::vector<Vec3> halves_S[2];
    for (const Vec3& p_S : structure.points_S) {
      const Vec3 ray_S = (p_S - structure.viewer_S).normalized();
      halves_S[random.Index(2)].push_back(p_S + random.Gaussian(noise_m) * ray_S);
    }
    IcpOptions options;
    options.freedom = freedom;
    const auto cloud = [&](const std::vector<Vec3>& points_S, const Pose3& X) {
      return std::unique_ptr<RegistrationCloud>(new RegistrationCloud(CloudFor(
          options, Voxelised(Transformed(X, points_S), kVoxel_m), X * structure.viewer_S)));
    };
    target = cloud(halves_S[0], X_iS);
    source = cloud(halves_S[1], X_kS);
  }

  /// What cannot be seen, as orthonormal columns in k with rotations scaled to metres.
  Eigen::MatrixXd Unseen(const Vec6& scale) const {
    const auto count = static_cast<Eigen::Index>(unseen_S.size());
    Eigen::MatrixXd motions(6, count);
    for (Eigen::Index i = 0; i < count; ++i)
      motions.col(i) = scale.asDiagonal() * (AdjointOf(X_kS) * unseen_S[i]);
    if (count == 0) return motions;
    return Eigen::MatrixXd(motions.householderQr().householderQ()) *
           Eigen::MatrixXd::Identity(6, count);
  }

  /// Rotations times the cloud's radius.
  Vec6 Scale() const {
    double squares = 0;
    for (const Vec3& p : source->points()) squares += p.squaredNorm();
    Vec6 scale = Vec6::Ones();
    scale.tail<3>() *= std::sqrt(squares / static_cast<double>(source->size()));
    return scale;
  }

  /// How much of what cannot be seen the registration says to have measured: 0 to 1.
  double FalselySeen(const IcpResult& result) const {
    const Vec6 scale = Scale();
    const Eigen::MatrixXd unseen = Unseen(scale);
    if (unseen.cols() == 0 || result.basis.cols() == 0) return 0;
    const Eigen::MatrixXd seen = Vec6(scale.cwiseInverse()).asDiagonal() * result.basis;
    const Eigen::MatrixXd Q = Eigen::MatrixXd(seen.householderQr().householderQ()) *
                              Eigen::MatrixXd::Identity(6, seen.cols());
    return (Q.transpose() * unseen).norm();
  }

  Pose3 AnyPose(Random& random) const {
    return RandomMotion(
        is_planar ? Twist(0.5, 0.5, 0.3, 0, 0, kPi) : Twist(0.5, 0.5, 0.3, 0.3, 0.3, kPi), random);
  }

  bool is_planar;
  Pose3 X_ik, X_iS, X_kS, initial_X_ik;
  std::vector<Vec6> unseen_S;
  std::unique_ptr<RegistrationCloud> target, source;
};

struct Kind {
  const char* name;
  MakeStructure make;
};
const Kind kKinds[] = {{"Wall", &StructureMaker::Wall},
                       {"Corridor", &StructureMaker::Corridor},
                       {"CorridorWithFloor", &StructureMaker::CorridorWithFloor},
                       {"Corner", &StructureMaker::Corner},
                       {"Box", &StructureMaker::Box},
                       {"Cylinder", &StructureMaker::Cylinder},
                       {"TankWall", &StructureMaker::TankWall},
                       {"Sphere", &StructureMaker::Sphere}};

/// What many registrations come to.
struct Tally {
  int pairs = 0, right = 0, elsewhere = 0, coordinates = 0;
  double normalised_squares = 0;

  void Add(const Pair& pair, const IcpResult& result) {
    constexpr double kAlike = 0.35;
    ++pairs;
    if (!result.usable) return;
    if (result.degenerate_directions != static_cast<int>(pair.unseen_S.size())) return;
    if (pair.FalselySeen(result) > kAlike) return;
    ++right;
    const Vec6 error = Log(Ominus(pair.X_ik, result.X_ik));
    const Eigen::VectorXd seen = result.basis.transpose() * error;
    const Eigen::MatrixXd P = result.basis.transpose() * result.covariance * result.basis;
    const double squares = seen.dot(P.ldlt().solve(seen));
    // It converged to another place; the gates of loop closing are there for that.
    constexpr double kFar = 25;
    if (squares > kFar * static_cast<double>(seen.size())) {
      ++elsewhere;
      return;
    }
    normalised_squares += squares;
    coordinates += static_cast<int>(seen.size());
  }
  double normalised() const { return normalised_squares / coordinates; }
};

Tally& operator+=(Tally& sum, const Tally& tally) {
  sum.pairs += tally.pairs;
  sum.right += tally.right;
  sum.elsewhere += tally.elsewhere;
  sum.coordinates += tally.coordinates;
  sum.normalised_squares += tally.normalised_squares;
  return sum;
}

Tally TallyOf(const Kind& kind, IcpFreedom freedom, double noise_m, int pairs) {
  IcpOptions options;
  options.freedom = freedom;
  Tally tally;
  for (int i = 0; i < pairs; ++i) {
    Random random(i, kind.name);
    const Structure structure = (StructureMaker(random).*kind.make)();
    const Pair pair(structure, freedom, noise_m, random);
    tally.Add(pair, Register(options, *pair.target, *pair.source, pair.initial_X_ik));
  }
  return tally;
}

// 1024 pairs.
TEST(DegeneracyTest, TrueDirectionsAreNamedAndErrorsAreAsLargeAsToldThere) {
  constexpr int kPairs = 32;
  Tally all;
  for (const IcpFreedom freedom : {IcpFreedom::kPlanar, IcpFreedom::kFull})
    for (const double noise_m : {0.01, 0.03})
      for (const Kind& kind : kKinds) {
        const Tally tally = TallyOf(kind, freedom, noise_m, kPairs);
        EXPECT_GE(tally.right, kPairs - 4) << kind.name << " " << noise_m;
        // Never more than twice as sure as it should be.
        EXPECT_LT(tally.normalised(), 4) << kind.name << " " << noise_m;
        EXPECT_GT(tally.normalised(), 0.25) << kind.name << " " << noise_m;
        all += tally;
      }
  EXPECT_GE(all.right, 0.98 * all.pairs);
  EXPECT_LE(all.elsewhere, 0.01 * all.pairs);
  EXPECT_GT(all.normalised(), 0.6);
  EXPECT_LT(all.normalised(), 1.6);
  RecordProperty("right", std::to_string(all.right) + " of " + std::to_string(all.pairs));
  RecordProperty("elsewhere", all.elsewhere);
  RecordProperty("normalised_error_squared", std::to_string(all.normalised()));
}

// Of all points most are the floor's, whose normals are noisy and tell nothing of x, y and yaw.
TEST(DegeneracyTest, AFloorDoesNotDrownWhatPilesHold) {
  constexpr int kPairs = 50;
  for (const double noise_m : {0.01, 0.03}) {
    const Tally tally = TallyOf({"PilesOverFloor", &StructureMaker::PilesOverFloor},
                                IcpFreedom::kPlanar, noise_m, kPairs);
    RecordProperty("right_" + std::to_string(noise_m), tally.right);
    EXPECT_GE(tally.right, 0.9 * kPairs) << noise_m;
    EXPECT_EQ(tally.elsewhere, 0) << noise_m;
    EXPECT_LT(tally.normalised(), 2) << noise_m;
    EXPECT_GT(tally.normalised(), 0.25) << noise_m;
  }
}

/// The part of the way from the registration's start to its result along what it says that it has
/// not measured, as a screw.
Vec6 UnmeasuredWay(const Pair& pair, const IcpResult& result) {
  const Vec6 scale = pair.Scale();
  const Mat6 all = Mat6::Identity();
  Eigen::MatrixXd free = all;
  if (pair.is_planar) {
    free.resize(6, 3);
    free << all.leftCols<2>(), all.rightCols<1>();
  }
  const Eigen::MatrixXd seen = free.transpose() * scale.cwiseInverse().asDiagonal() * result.basis;
  const Eigen::MatrixXd Q = Eigen::MatrixXd(seen.householderQr().householderQ()) *
                            Eigen::MatrixXd::Identity(seen.rows(), seen.cols());
  const Eigen::VectorXd way =
      free.transpose() * scale.asDiagonal() * Log(Ominus(pair.initial_X_ik, result.X_ik));
  return scale.cwiseInverse().asDiagonal() * free * (way - Q * (Q.transpose() * way));
}

// From far starts: what is taken for partners at first holds directions that nothing holds later.
TEST(DegeneracyTest, NoRegistrationGoesFarAroundWhatItHasNotMeasured) {
  for (const IcpFreedom freedom : {IcpFreedom::kPlanar, IcpFreedom::kFull})
    for (const Kind& kind : kKinds) {
      IcpOptions options;
      options.freedom = freedom;
      int degenerate = 0;
      for (int i = 0; i < 30; ++i) {
        Random random(i, kind.name);
        Pair pair((StructureMaker(random).*kind.make)(), freedom, 0.03, random);
        pair.initial_X_ik = pair.X_ik * RandomMotion(Twist(0.6, 0.6, 0, 0, 0, 0.3), random);
        const IcpResult result = Register(options, *pair.target, *pair.source, pair.initial_X_ik);
        if (!result.usable || result.degenerate_directions == 0) continue;
        ++degenerate;
        // How far the screw is from a straight line.
        const Vec6 way = UnmeasuredWay(pair, result);
        const double bend_m = way.head<3>().norm() * way.tail<3>().norm() / 4;
        EXPECT_LT(bend_m, 1.1 * options.point_sigma_m) << kind.name << " " << i;
      }
      RecordProperty(kind.name, degenerate);
    }
}

// A blade is hardly held in other directions either: which, depends on its noise.
TEST(DegeneracyTest, NoMoreOfABladeIsSeenThanThereIs) {
  for (const IcpFreedom freedom : {IcpFreedom::kPlanar, IcpFreedom::kFull}) {
    IcpOptions options;
    options.freedom = freedom;
    int usable = 0, false_ones = 0;
    for (int i = 0; i < 40; ++i) {
      Random random(i, "blade");
      const Pair pair(StructureMaker(random).Blade(), freedom, 0.02, random);
      const IcpResult result = Register(options, *pair.target, *pair.source, pair.initial_X_ik);
      if (!result.usable) continue;
      ++usable;
      false_ones += pair.FalselySeen(result) > 0.35;
    }
    EXPECT_GT(usable, freedom == IcpFreedom::kFull ? 30 : 0);
    EXPECT_LE(false_ones, 2);
  }
}

TEST(DegeneracyTest, TheConstantOfZhangAndOthersIsThereToCompare) {
  IcpOptions options;
  options.degeneracy = Degeneracy::kShare;
  Random random(1, "share");
  const Pair pair(StructureMaker(random).Corridor(), IcpFreedom::kPlanar, 0.02, random);
  const IcpResult result = Register(options, *pair.target, *pair.source, pair.initial_X_ik);
  ASSERT_TRUE(result.usable);
  EXPECT_EQ(result.degenerate_directions, 1);
  EXPECT_LT(pair.FalselySeen(result), 0.35);
  options.degenerate_share = 1;
  EXPECT_FALSE(Register(options, *pair.target, *pair.source, pair.initial_X_ik).usable);
}

}  // namespace
}  // namespace vog
