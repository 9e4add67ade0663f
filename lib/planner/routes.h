#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lib/planner/free_places.h"
#include "lib/planner/planner_options.h"

namespace vog {

/// A place that the vehicle can get to, with headings that it can turn between there.
struct Reached {
  int place = -1;      ///< Of FreePlaces; -1 is where the vehicle is.
  HeadingSet arc = 0;  ///< In narrow places not all headings.
  double time_s = 0;   ///< Of the way there at full speed.
  int from = -1;       ///< Where in reached() the way comes from; -1 for the vehicle's place.
};

/// Shortest ways through free space from where the vehicle is to all that it can reach
/// [Dijkstra 1959], on FreePlaces's lattice; the one that is flown is tested in full and
/// straightened.
class Routes {
 public:
  Routes(const PlannerOptions& options, const MotionLimits& limits,
         const Eigen::AlignedBox3d& box_W);

  /// Looks at the map and finds all that can be reached from `at`.
  void Search(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);

  /// Nearest first; the first is where the vehicle is.
  const std::vector<Reached>& reached() const { return reached_; }
  Vec3 PositionOf(const Reached& reached) const;
  /// The way to reached()[index] and the turn at its end, in steps that can be flown: FlownStep().
  /// Nothing where the map, looked at closely, is against it; then that step counts as blocked for
  /// some searches, each time for longer, and reached() is found anew.
  std::optional<std::vector<Waypoint>> RouteTo(const OccupancyMap& map,
                                               const CollisionChecker& checker, int index,
                                               double yaw_rad);
  /// A turn at reached()[index] was found not to be free: the place counts as blocked for some
  /// searches, that of the vehicle as one where it cannot turn, and reached() is found anew.
  void RefuseTurnAt(int index);
  /// Which of reached() is nearest to a point, within `radius_m`, of those with one of `headings`;
  /// nothing when none is.
  std::optional<int> ReachedNear(const Vec3& p_W, double radius_m,
                                 HeadingSet headings = kAllHeadings) const;

  /// The lattice, as the last search saw it.
  const FreePlaces& free_places() const { return free_; }

 private:
  struct Refusal {
    int times = 0;
    int until_search = 0;
  };

  bool IsRefused(int from, int to) const;
  void ConnectVehicle(const OccupancyMap& map, const CollisionChecker& checker);
  void FindReached();
  void Refuse(int from, int to);
  std::vector<int> ChainTo(int index) const;
  std::vector<Waypoint> WaypointsOf(const std::vector<int>& chain, double yaw_rad) const;

  MotionLimits limits_;
  FreePlaces free_;
  Waypoint at_;
  std::vector<Reached> reached_;
  std::vector<Reached> starts_;                      // Places next to the vehicle.
  std::map<std::pair<int, int>, Refusal> refusals_;  // By the places that a step joins.
  std::vector<bool> has_refusals_;                   // By place: whether it is in any of these.
  int searches_ = 0;
};

}  // namespace vog
