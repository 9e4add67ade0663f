#include "lib/loopclosure/relocalisation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr double kSigmas = 2;
constexpr int kMostSteps = 6;  ///< To either side.
constexpr std::size_t kMostPlaces = 4;
/// Places are compared by a part of the points, which tells which are worth a registration.
constexpr std::size_t kComparedPoints = 400;
/// What differs by less than this share does so by chance.
constexpr double kNearlyAsMuch = 0.85;

/// A half axis of the ellipse of places, and how many steps go along it.
struct HalfAxis {
  Eigen::Vector2d direction;
  double length_m;
  int steps;

  Eigen::Vector2d At(int step) const {
    return steps == 0 ? Eigen::Vector2d(0, 0)
                      : Eigen::Vector2d(direction * (length_m * step / steps));
  }
};

std::vector<HalfAxis> HalfAxes(const Mat6& covariance, double reach_m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance.topLeftCorner<2, 2>());
  std::vector<HalfAxis> axes;
  for (int i = 0; i < 2; ++i) {
    const double length_m = kSigmas * std::sqrt(std::max(0.0, eigen.eigenvalues()[i]));
    axes.push_back({eigen.eigenvectors().col(i), length_m,
                    static_cast<int>(std::min<double>(kMostSteps, length_m / reach_m))});
  }
  return axes;
}

double DistanceOf(const Pose3& a, const Pose3& b) {
  return (a.translation() - b.translation()).norm();
}

}  // namespace

bool IsLost(const IcpOptions& icp, double sigma_m) { return sigma_m > icp.start_distance_m / 2; }

std::vector<SearchPlace> SearchPlaces(const IcpOptions& icp, const SubmapShape& target,
                                      const SubmapShape& source, const Pose3& predicted_X_ik,
                                      const Mat6& covariance) {
  const auto axes = HalfAxes(covariance, icp.start_distance_m);
  std::vector<SearchPlace> places;
  for (int a = -axes[0].steps; a <= axes[0].steps; ++a)
    for (int b = -axes[1].steps; b <= axes[1].steps; ++b) {
      const Eigen::Vector2d shift = axes[0].At(a) + axes[1].At(b);
      const Pose3 X_ik = predicted_X_ik * MakePose({shift.x(), shift.y(), 0});
      places.push_back({X_ik, PredictOverlap(target, source, X_ik, kComparedPoints)});
    }
  std::stable_sort(places.begin(), places.end(),
                   [](const auto& p, const auto& q) { return p.overlap > q.overlap; });
  if (places.size() > kMostPlaces) places.resize(kMostPlaces);
  return places;
}

SearchResult RegisterFrom(const IcpOptions& icp, const SubmapRegion& target,
                          const SubmapShape& source, const std::vector<Pose3>& starts) {
  std::vector<IcpResult> results;
  double largest_overlap = 0;
  for (const Pose3& start : starts) {
    results.push_back(Register(icp, *target.cloud, source.cloud, start));
    if (results.back().usable) largest_overlap = std::max(largest_overlap, results.back().overlap);
  }
  SearchResult found{results.front(), false};
  std::erase_if(results, [&](const IcpResult& result) {
    return !result.usable || result.overlap < kNearlyAsMuch * largest_overlap;
  });
  if (results.empty()) return found;
  found.registration =
      *std::min_element(results.begin(), results.end(),
                        [](const IcpResult& a, const IcpResult& b) { return a.rmse_m < b.rmse_m; });
  for (const IcpResult& other : results)
    found.is_ambiguous =
        found.is_ambiguous ||
        (kNearlyAsMuch * other.rmse_m < found.registration.rmse_m &&
         DistanceOf(other.X_ik, found.registration.X_ik) > icp.start_distance_m / 2);
  return found;
}

}  // namespace vog
