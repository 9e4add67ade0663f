#pragma once

#include <map>
#include <optional>
#include <vector>

#include "lib/geometry/waypoint.h"
#include "lib/planner/routes.h"

namespace vog {

/// A submap that is worth being seen again: a loop closure with it would make the map more certain.
struct RevisitPlace {
  int submap = 0;
  Waypoint first, last;  ///< Where the vehicle was at its first and its last scan.
  double gain = 0;       ///< Share of the map's mean position error that would be gone.
};

/// The vehicle is where a submap began when it is this near.
inline constexpr double kRevisitNear_m = 0.5;

/// How the mission has spent its time.
struct FlightTime {
  double all_s = 0;
  double revisits_s = 0;  ///< Of that.
  double submap_s = 0;    ///< That a submap takes.
};

/// Decides whether to see a submap again now, and which.
///
/// A revisit of t seconds in a mission of T is worth gain - 2 t / T: each per cent of time has to
/// take away two of the error, and all of it a tenth. Together they may take a share of the time
/// that is set.
class RevisitChoice {
 public:
  RevisitChoice(double share, const MotionLimits& limits) : share_(share), limits_(limits) {}

  /// What there is to choose from, instead of what there was.
  void Offer(std::vector<RevisitPlace> places) {
    places_ = std::move(places);
    is_new_ = true;
  }
  /// Whether nobody has asked for the best of them yet, or since LookAgain().
  bool IsNew() const { return is_new_; }
  void LookAgain() { is_new_ = true; }
  /// Of a place that is on offer; 0 for others.
  double GainOf(int submap) const;
  /// Whether any place may be worth it, the way to it being no longer than the straight line.
  bool IsWorthASearch(const Waypoint& at, const FlightTime& time) const;
  /// The best one by the ways that `routes` has found from `at`.
  std::optional<RevisitPlace> Best(const Routes& routes, const FlightTime& time);
  /// It is tried now: again only when the mission has become a quarter longer.
  void NoteTried(int submap, const FlightTime& time) { tried_at_s_[submap] = time.all_s; }

 private:
  /// Worth of a revisit with a way there of `way_s`; not positive when it is too long.
  double WorthOf(const RevisitPlace& place, double way_s, const FlightTime& time) const;

  double share_;
  MotionLimits limits_;
  std::vector<RevisitPlace> places_;
  bool is_new_ = false;
  std::map<int, double> tried_at_s_;
};

}  // namespace vog
