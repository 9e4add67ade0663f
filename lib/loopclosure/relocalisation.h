#pragma once

#include <vector>

#include "lib/loopclosure/loop_closure.h"

namespace vog {

/// Whether a registration that begins at the predicted pose may miss the true one, `sigma_m` the
/// largest horizontal standard deviation of the prediction: it is more than half of how far
/// correspondences reach.
bool IsLost(const IcpOptions& icp, double sigma_m);

/// A pose at which a registration may begin.
struct SearchPlace {
  Pose3 X_ik = Pose3::Identity();
  double overlap = 0;  ///< Predicted there.
};

/// The places at which two submaps overlap most, best first: of those within two standard
/// deviations of the prediction in x and y, as far apart as correspondences reach (at most 13 by 13
/// of them; farther apart where that is not enough). Heading is taken as predicted: gyros keep it.
std::vector<SearchPlace> SearchPlaces(const IcpOptions& icp, const SubmapShape& target,
                                      const SubmapShape& source, const Pose3& predicted_X_ik,
                                      const Mat6& covariance);

/// Of the registrations that begin at `starts`, among those that overlap about as much as the one
/// that overlaps most, that with the smallest residuals.
struct SearchResult {
  IcpResult registration;
  bool is_ambiguous = false;  ///< Another one, elsewhere, has residuals about as small.
};
/// @pre there are starts.
SearchResult RegisterFrom(const IcpOptions& icp, const SubmapRegion& target,
                          const SubmapShape& source, const std::vector<Pose3>& starts);

}  // namespace vog
