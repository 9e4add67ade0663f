#include "lib/registration/icp.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "lib/base/chi_square.h"
#include "lib/geometry/voxel_grid.h"

namespace vog {
namespace {

constexpr int kMinCorrespondences = 20;
// While correspondences reach far, one of so many points tells enough.
constexpr int kCoarseStride = 4;
constexpr int kMaxWaysBack = 3;
constexpr double kConverged = 1e-5;  // Metres, or radians times the cloud's radius.

template <int D>
using Vector = Eigen::Matrix<double, D, 1>;
template <int D>
using Matrix = Eigen::Matrix<double, D, D>;
template <int D>
using Columns = Eigen::Matrix<double, D, Eigen::Dynamic>;

/// The D directions in which a pose may move: all six, or x, y and yaw. Steps have a coordinate for
/// each, rotations scaled to metres by the cloud's radius.
template <int D>
struct FreeDirections {
  static_assert(D == 3 || D == 6);
  double radius_m;

  /// Its columns are the directions.
  static Eigen::Matrix<double, 6, D> Basis() {
    if constexpr (D == 6) {
      return Mat6::Identity();
    } else {
      Eigen::Matrix<double, 6, 3> basis = Eigen::Matrix<double, 6, 3>::Zero();
      basis(0, 0) = basis(1, 1) = basis(5, 2) = 1;
      return basis;
    }
  }
  /// From scaled coordinates to a pose's.
  Vec6 unscale() const { return (Vec6() << Vec3::Ones(), Vec3::Constant(1 / radius_m)).finished(); }
  Vec6 Twist(const Vector<D>& step) const { return unscale().asDiagonal() * (Basis() * step); }
  Vector<D> StepOf(const Pose3& motion) const {
    return Basis().transpose() * unscale().cwiseInverse().asDiagonal() * Log(motion);
  }
  /// How the distance of `p_k` along `direction_k` changes with a step xi in X_ik * Exp(xi).
  Vector<D> RowOf(const Vec3& p_k, const Vec3& direction_k) const {
    Vector<D> row;
    if constexpr (D == 6) {
      row.template head<3>() = direction_k;
      row.template tail<3>() = p_k.cross(direction_k) / radius_m;
    } else {
      row[0] = direction_k.x();
      row[1] = direction_k.y();
      row[2] = (p_k.x() * direction_k.y() - p_k.y() * direction_k.x()) / radius_m;
    }
    return row;
  }
};

std::size_t UsedPoints(const IcpOptions& options, const RegistrationCloud& source) {
  return std::min(source.size(), static_cast<std::size_t>(options.max_points));
}

/// Which of the used points a linearisation with correspondences of such a reach takes: each
/// so-manieth.
int StrideAt(const IcpOptions& options, double max_distance_m) {
  return max_distance_m > options.end_distance_m ? kCoarseStride : 1;
}

/// A point of the source and the plane of the target that it lies on.
struct Correspondence {
  Vec3 p_i, p_k;
  Vec3 normal_k;  ///< The target's normal, in k.
  double residual_m;
  double weight;
  double tilt_variance;  ///< Of the normal in any direction across it [rad^2].
};

/// Calls `visit` for each correspondence not farther apart than `max_distance_m`. Returns how many
/// points were tried.
template <class Visit>
int ForEachCorrespondence(const IcpOptions& options, const RegistrationCloud& target,
                          const RegistrationCloud& source, const Pose3& X_ik, double max_distance_m,
                          Visit visit) {
  const Mat3 R_ik = X_ik.linear();
  // Beyond this a residual counts linearly (Huber).
  const double linear_from_m = 0.5 * max_distance_m;
  const std::size_t used = UsedPoints(options, source);
  const auto stride = static_cast<std::size_t>(StrideAt(options, max_distance_m));
  int tried = 0;
  for (std::size_t u = 0; u < used; u += stride) {
    ++tried;
    const std::size_t s = u * source.size() / used;
    const Vec3 p_i = X_ik * source.points()[s];
    const auto nearest = target.NearestWithin(p_i, max_distance_m);
    if (!nearest) continue;
    const LocalPlane& plane = target.planes()[nearest->index];
    if (plane.normal.isZero()) continue;
    const Vec3 normal_k = R_ik.transpose() * plane.normal;
    const Vec3& own_normal_k = source.planes()[s].normal;
    if (!own_normal_k.isZero() && normal_k.dot(own_normal_k) < options.min_normal_cosine) continue;
    const double residual_m = plane.normal.dot(p_i - target.points()[nearest->index]);
    visit(Correspondence{
        .p_i = p_i,
        .p_k = source.points()[s],
        .normal_k = normal_k,
        .residual_m = residual_m,
        .weight = std::min(1.0, linear_from_m / std::max(std::abs(residual_m), 1e-9)),
        .tilt_variance = plane.TiltVariance(options.point_sigma_m)});
  }
  return tried;
}

/// The normal equations of one linearisation, in coordinates whose rotations are scaled to metres.
template <int D>
struct Linearisation {
  Matrix<D> H = Matrix<D>::Zero();
  Matrix<D> noise = Matrix<D>::Zero();  ///< What noise of the normals adds to H, on the average.
  Vector<D> b = Vector<D>::Zero();
  double squares = 0;
  double weights = 0;
  int tried = 0, correspondences = 0;  ///< Points, and those of them that have a partner.
};

template <int D>
Linearisation<D> Linearise(const IcpOptions& options, const RegistrationCloud& target,
                           const RegistrationCloud& source, const Pose3& X_ik,
                           double max_distance_m, const FreeDirections<D>& free) {
  Linearisation<D> sum;
  sum.tried = ForEachCorrespondence(
      options, target, source, X_ik, max_distance_m, [&](const Correspondence& c) {
        const Vector<D> J = free.RowOf(c.p_k, c.normal_k);
        sum.H += c.weight * J * J.transpose();
        sum.b -= c.weight * c.residual_m * J;
        const Vec3 across_k = c.normal_k.unitOrthogonal();
        for (const Vec3& tilted_k : {across_k, Vec3(c.normal_k.cross(across_k))}) {
          const Vector<D> feigned = free.RowOf(c.p_k, tilted_k);
          sum.noise += c.weight * c.tilt_variance * feigned * feigned.transpose();
        }
        sum.squares += c.weight * c.residual_m * c.residual_m;
        sum.weights += c.weight;
        ++sum.correspondences;
      });
  return sum;
}

/// Points that share an error.
template <int D>
struct Patch {
  Vector<D> row = Vector<D>::Zero();
  double residual_m = 0, weight = 0;
};
template <int D>
using Patches = std::map<VoxelKey, Patch<D>>;

template <int D>
void AddTo(Patch<D>& patch, const Correspondence& c, const Vector<D>& row) {
  patch.row += c.weight * row;
  patch.residual_m += c.weight * c.residual_m;
  patch.weight += c.weight;
}

/// Covariance of b if each patch is off by one error, as large as the mean residuals of the patches
/// tell, to which `fitted` coordinates were fitted.
template <int D>
Matrix<D> ErrorsOf(const Patches<D>& patches, double least_m, Eigen::Index fitted) {
  Matrix<D> rows = Matrix<D>::Zero();
  double squares_m2 = 0, weight = 0;
  for (const auto& [key, patch] : patches) {
    rows += patch.row * patch.row.transpose();
    squares_m2 += patch.residual_m * patch.residual_m / patch.weight;
    weight += patch.weight;
  }
  const auto count = static_cast<double>(patches.size());
  const double freedom = std::max(1.0, count - static_cast<double>(fitted));
  return std::max(least_m * least_m, squares_m2 / weight * count / freedom) * rows;
}

/// Covariance of b. Voxels of one patch of surface do not err independently; and since grids stand
/// upright, steep surfaces repeat the errors of their rounding all the way up.
template <int D>
Matrix<D> SharedErrors(const IcpOptions& options, const RegistrationCloud& target,
                       const RegistrationCloud& source, const Pose3& X_ik,
                       const FreeDirections<D>& free, Eigen::Index fitted) {
  const VoxelGrid grid(options.correlation_m);
  Patches<D> cells, columns;
  ForEachCorrespondence(options, target, source, X_ik, options.end_distance_m,
                        [&](const Correspondence& c) {
                          const Vector<D> row = free.RowOf(c.p_k, c.normal_k);
                          const VoxelKey cell = grid.KeyOf(c.p_i);
                          AddTo(cells[cell], c, row);
                          AddTo(columns[{cell.x, cell.y, 0}], c, row);
                        });
  return ErrorsOf(cells, options.least_shared_error_m, fitted) + ErrorsOf(columns, 0, fitted);
}

/// What the points hold of the free coordinates.
template <int D>
struct Directions {
  Columns<D> measured;        ///< Its columns' products with a step are measured.
  Matrix<D> gain;             ///< From b to the shortest step with the best such products.
  Vector<D> signal_to_noise;  ///< Of all directions, ascending.
  int degenerate = 0;         ///< So many of them are not measured.
};

/// Directions u that H and the noise treat apart from each other: u^T H v = 0 and u^T noise v = 0.
template <int D>
Directions<D> WellConditioned(const IcpOptions& options, const Linearisation<D>& at) {
  // Where normals are hardly tilted, not to divide by nothing.
  constexpr double kLeastNoise = 1e-6;
  const Matrix<D> noise = at.noise + kLeastNoise * at.weights * Matrix<D>::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix<D>> by_noise(at.H, noise);
  Matrix<D> u = by_noise.eigenvectors(), duals = noise * u;
  Vector<D> stiffness = by_noise.eigenvalues();
  double least = options.min_signal_to_noise;
  if (options.degeneracy == Degeneracy::kShare) {
    const Eigen::SelfAdjointEigenSolver<Matrix<D>> by_share(at.H);
    u = duals = by_share.eigenvectors();
    stiffness = by_share.eigenvalues();
    least = options.degenerate_share * at.weights;
  }
  Directions<D> directions;
  while (directions.degenerate < D && stiffness[directions.degenerate] < least)
    ++directions.degenerate;
  const Eigen::Index kept = D - directions.degenerate;
  directions.measured = duals.rightCols(kept);
  const Eigen::MatrixXd products =
      stiffness.tail(kept).cwiseInverse().asDiagonal() * u.rightCols(kept).transpose();
  directions.gain = directions.measured *
                    (directions.measured.transpose() * directions.measured).ldlt().solve(products);
  directions.signal_to_noise = by_noise.eigenvalues();
  return directions;
}

/// Orthonormal columns that span those of `columns`.
Eigen::MatrixXd SpanOf(const Eigen::MatrixXd& columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(columns).householderQ() *
         Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

/// Gauss-Newton steps from a pose, and where they led.
template <int D>
struct Descent {
  Pose3 X_ik;
  Linearisation<D> at;  ///< The last one.
  Directions<D> directions;
  int iterations = 0;
  bool usable = false;
};

/// Correspondences reach `distance_m` at first and end_distance_m in the end.
template <int D>
Descent<D> Descend(const IcpOptions& options, const RegistrationCloud& target,
                   const RegistrationCloud& source, const Pose3& X_ik, double distance_m,
                   const FreeDirections<D>& free) {
  const double shrink = std::pow(options.end_distance_m / options.start_distance_m,
                                 1.0 / std::max(1, options.iterations / 2));
  Descent<D> descent;
  descent.X_ik = X_ik;
  for (descent.iterations = 1; descent.iterations <= options.iterations; ++descent.iterations) {
    descent.at = Linearise(options, target, source, descent.X_ik, distance_m, free);
    const int stride = StrideAt(options, distance_m);
    if (stride * descent.at.correspondences < kMinCorrespondences) return descent;
    descent.directions = WellConditioned(options, descent.at);
    if (descent.directions.measured.cols() == 0) return descent;
    const Vector<D> step = descent.directions.gain * descent.at.b;
    descent.X_ik = descent.X_ik * Exp(free.Twist(step));
    const bool is_fine = distance_m <= options.end_distance_m;
    if (is_fine && step.norm() < kConverged) break;
    distance_m = std::max(options.end_distance_m, distance_m * shrink);
  }
  descent.usable = true;
  return descent;
}

/// The way back from where the descent led to `X_ik`, as far as it goes along directions that are
/// not measured: along a symmetry of the structure, a screw, every place fits as well.
template <int D>
Vec6 WayBackAlongUnmeasured(const Descent<D>& descent, const Pose3& X_ik,
                            const FreeDirections<D>& free) {
  const Columns<D> span = SpanOf(descent.directions.measured);
  const Vector<D> back = free.StepOf(Ominus(descent.X_ik, X_ik));
  return free.Twist(back - span * (span.transpose() * back));
}

/// How far the middle of a short screw lies from a straight way, within a factor of two [m].
double BendOf(const Vec6& screw) { return screw.head<3>().norm() * screw.tail<3>().norm() / 4; }

/// The way back along what is not measured, if it bends by more than points err.
template <int D>
std::optional<Vec6> BentWayBack(const IcpOptions& options, const Descent<D>& descent,
                                const Pose3& X_ik, const FreeDirections<D>& free) {
  if (!descent.usable || descent.directions.degenerate == 0) return std::nullopt;
  const Vec6 back = WayBackAlongUnmeasured(descent, X_ik, free);
  return BendOf(back) > options.point_sigma_m ? std::optional(back) : std::nullopt;
}

/// Whether noise alone may tilt a level surface as far.
bool MayBeLevel(const LocalPlane& plane, double point_sigma_m) {
  return plane.normal.head<2>().squaredNorm() <= ChiSquare99(2) * plane.TiltVariance(point_sigma_m);
}

template <int D>
IcpResult RegisterIn(const FreeDirections<D>& free, const IcpOptions& options,
                     const RegistrationCloud& target, const RegistrationCloud& source,
                     const Pose3& initial_X_ik) {
  IcpResult result;
  result.X_ik = initial_X_ik;
  if (target.size() < kMinCorrespondences || source.size() < kMinCorrespondences) return result;
  Descent<D> descent =
      Descend(options, target, source, initial_X_ik, options.start_distance_m, free);
  // What nothing holds in the end may have been held, wrongly, by what was taken for partners in
  // the beginning.
  std::optional<Vec6> back = BentWayBack(options, descent, initial_X_ik, free);
  for (int tries = 0; back && tries < kMaxWaysBack; ++tries) {
    descent =
        Descend(options, target, source, descent.X_ik * Exp(*back), options.end_distance_m, free);
    back = BentWayBack(options, descent, initial_X_ik, free);
  }
  result.X_ik = descent.X_ik;
  result.iterations = descent.iterations;
  if (!descent.usable || back) return result;
  const Linearisation<D>& at = descent.at;
  const Directions<D>& directions = descent.directions;

  result.usable = true;
  result.correspondences = at.correspondences;
  result.overlap = at.correspondences / static_cast<double>(at.tried);
  result.rmse_m = std::sqrt(at.squares / at.weights);
  result.degenerate_directions = directions.degenerate;
  result.signal_to_noise.assign(directions.signal_to_noise.begin(),
                                directions.signal_to_noise.end());
  const Columns<6> measured = free.Basis() * directions.measured;
  const Eigen::Matrix<double, 6, D> gain = free.Basis() * directions.gain;
  // What each point errs for itself is little, but all there is where one patch is all there is.
  const Matrix<D> errors =
      SharedErrors(options, target, source, result.X_ik, free, measured.cols()) +
      options.point_sigma_m * options.point_sigma_m * at.H;
  const Mat6 known = gain * errors * gain.transpose();
  // What is not measured has the variance of something unknowable.
  constexpr double kUnknowable = 1e6;
  const Columns<6> span = SpanOf(measured);
  const Mat6 unknown = kUnknowable * (Mat6::Identity() - span * span.transpose());
  const Vec6 unscale = free.unscale();
  result.covariance = unscale.asDiagonal() * (known + unknown) * unscale.asDiagonal();
  result.basis = SpanOf(unscale.cwiseInverse().asDiagonal() * measured);
  return result;
}

}  // namespace

RegistrationCloud CloudFor(const IcpOptions& options, std::vector<Vec3> points,
                           const Vec3& seen_from) {
  if (options.freedom == IcpFreedom::kFull)
    return {std::move(points), options.normal_radius_m, seen_from};
  const RegistrationCloud all(std::move(points), options.normal_radius_m, seen_from);
  std::vector<Vec3> kept;
  std::vector<LocalPlane> planes;
  for (std::size_t p = 0; p < all.size(); ++p) {
    const LocalPlane& plane = all.planes()[p];
    if (!plane.normal.isZero() && MayBeLevel(plane, options.point_sigma_m)) continue;
    kept.push_back(all.points()[p]);
    planes.push_back(plane);
  }
  return {std::move(kept), std::move(planes)};
}

IcpResult Register(const IcpOptions& options, const RegistrationCloud& target,
                   const RegistrationCloud& source, const Pose3& initial_X_ik) {
  const auto in = [&](auto free) {
    return RegisterIn(free, options, target, source, initial_X_ik);
  };
  if (options.freedom == IcpFreedom::kFull) return in(FreeDirections<6>{source.radius_m()});
  return in(FreeDirections<3>{source.radius_m()});
}

}  // namespace vog
