#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "lib/planner/looked_at.h"
#include "lib/planner/panorama.h"
#include "lib/planner/planner_options.h"
#include "lib/planner/routes.h"
#include "lib/planner/view_gain.h"
#include "lib/planner/view_planner.h"

namespace vog {

/// The default planner: of all places that can be reached through known free space it takes the
/// view with the most to see for the time that it costs, way and turn included, and goes there by
/// the shortest free way. Gains of far places are remembered; because knowledge grows, they are
/// upper bounds, and only those that could be the best are looked at again [lazy greedy search,
/// Minoux 1978]. Nothing is left to gain when every place that can be reached has been looked at
/// anew and none gains.
///
/// Work is bounded by counts: places and views looked at in a plan, and places in each Look().
class CoveragePlanner final : public ViewPlanner {
 public:
  CoveragePlanner(const PlannerOptions& options, const MotionLimits& limits,
                  const SonarOptions& sonar, const Eigen::AlignedBox3d& box_W, std::int64_t seed);

  ViewPlan Plan(const OccupancyMap& map, const CollisionChecker& checker,
                const Waypoint& at) override;
  void Look(const OccupancyMap& map, const Waypoint& at) override;
  bool IsObsolete(const OccupancyMap& map, const std::vector<Waypoint>& path,
                  int visible) const override;
  bool IsInVain(const VoxelKey& key) const override { return looked_at_.IsInVain(key); }

 private:
  struct Known {
    GainByHeading gain{};
    int in_plan = -1;        ///< When it was looked at; -1 is never.
    int empty_in_plan = -1;  ///< When there was nothing to see even through gaps.
    int ahead_in_plan = -1;  ///< When its way was tested: MustGoAhead().
    bool goes_ahead = false;
  };
  struct View {
    int reached = -1;  ///< Of routes_.
    int heading = 0;
    int turns_on = 0;    ///< Headings that it then turns on by, to the left; negative: right.
    double utility = 0;  ///< Voxels a second.
    double gain = 0;     ///< At its end, looked at with all rays.

    /// That it ends with.
    int last_heading() const { return (heading + turns_on + kHeadings) % kHeadings; }
  };

  Known& KnownOf(const Reached& reached);
  void LookFrom(const OccupancyMap& map, const Reached& reached, const OccupancyMap::EndsRay& ends);
  /// The look of the search that ends the exploration: where there is nothing to see even through
  /// gaps, which is nearly everywhere in the end, one look tells of both.
  void SearchFrom(const OccupancyMap& map, const Reached& reached);
  /// Whether that search has looked at the place already.
  bool IsSearched(const Reached& reached);
  /// Whether no heading has enough to see to count.
  bool IsEmpty(const Known& known) const;
  /// Whether so many ways to a place were refused that it is left out.
  bool IsGivenUp(int place) const;
  /// What a heading of a place gains by what is known of it; 0 when that counts as nothing.
  double GainOf(const Reached& reached, int heading);
  /// The best heading of a place by what is known of it, or the best turn: what the fan sees while
  /// it turns counts too.
  View BestViewAt(int index, const Waypoint& at);
  /// The best of those that begin with `heading` after `time_s` and turn on to one side.
  View BestTurnOn(int index, int heading, int side, double time_s);
  /// What a view costs, way and turn included.
  double ViewTime_s(const Reached& reached, int heading, const Waypoint& at);
  /// Tests whether the sonar must be turned to where the way to a place goes, FlownStep(), by the
  /// straight line.
  bool MustGoAhead(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at,
                   const Reached& reached);
  double WeightOf(const VoxelKey& key) const;
  /// Rays end beside what is occupied: there the surface most likely goes on, and what is behind it
  /// is not to be seen. Not once nothing is left to gain so: then through the gaps that there are.
  OccupancyMap::EndsRay WhereSurfacesGoOn() const;
  double GainAt(const OccupancyMap& map, const Waypoint& at) const;
  /// Nearest first, as long as more looks than those are left.
  void LookAtNewPlaces(const OccupancyMap& map, int looks_to_leave);
  /// The best view by what is known, each of those that were best looked at anew.
  View FindBest(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// The way to a view, and its turn as far as there is room. Nothing where the way is not free.
  std::optional<std::vector<Waypoint>> WayTo(const OccupancyMap& map,
                                             const CollisionChecker& checker, const View& view);
  ViewPlan FindPlan(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  ViewPlan GoTo(const View& view, const std::vector<Waypoint>& way);
  ViewPlan LookForMore(const OccupancyMap& map);
  /// In space too narrow for the lattice: a tree of random views, with all that it can reach. Some
  /// of them are looked at in each plan.
  ViewPlan GrowTree(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// Begins the search that ends the exploration anew.
  void NoteGain();

  PlannerOptions options_;
  MotionLimits limits_;
  Eigen::AlignedBox3d box_W_;
  std::int64_t seed_;
  double turn_on_s_;      // By one heading.
  double turn_on_share_;  // Of the gain of a heading that is turned over, what is seen.
  ViewGain view_;
  Panorama panorama_;
  LookedAt looked_at_;
  Routes routes_;
  std::vector<Known> known_;  // By place; the last one is the vehicle's.
  int plans_ = 0;
  int looks_left_ = 0;           // In this plan.
  int nothing_since_ = -1;       // Plan since which none of the places looked at has gained.
  int searched_since_ = -1;      // The same of looks through gaps, once it looks through them.
  bool looks_through_ = false;   // Through gaps beside what is occupied.
  std::map<int, int> refusals_;  // Of ways to a place, by its number, since a plan went anywhere.
  int tree_views_ = 0;           // Of the tree that have been looked at.
  int tree_of_plan_ = 0;         // The plan in which it was first grown.
};

}  // namespace vog
