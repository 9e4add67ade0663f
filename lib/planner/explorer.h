#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/time.h"
#include "lib/planner/mission_options.h"
#include "lib/planner/revisit_choice.h"
#include "lib/planner/routes.h"
#include "lib/planner/view_planner.h"
#include "lib/scan/sonar.h"

namespace vog {

/// A path to fly, and the tree that it comes from.
struct Plan {
  std::int64_t id = 0;
  std::vector<Waypoint> path;  ///< From the vehicle's place on; a single waypoint: stay there.
  std::vector<TreeNode> tree;
  int best = -1;  ///< Node that the best branch ends in.
};

/// What the exploration leaves: unknown voxels of its box that have a free one beside them.
struct Unseen {
  std::int64_t voxels = 0;
  std::int64_t in_vain = 0;  ///< Of these, looked at for so long that they cannot be seen.
};

enum class ExplorerState {
  kExploring,
  kLocalising,  ///< Sees an earlier submap again, to close a loop.
  kRevisiting,
  kReturning,
  kFinished,
};

/// The exploration as a machine that is told poses and says where to go: it asks a planner of views
/// for the next path, watches it while it is flown, and when no view gains anything or a budget is
/// used goes home and ends.
///
/// The path is tested again while it is flown; a hull that finds itself inside its own clearance
/// after the map has moved backs out along the way it came, or else leaves to any side, with as
/// much clearance as there is from what is surely where the map shows it. Where the map is
/// uncertain, paths are flown with the sonar ahead or not at all, a place that offers all
/// clearances comes first, and a vehicle that finds no way turns round to see more.
class Explorer {
 public:
  Explorer(const PlannerOptions& options, const MotionLimits& limits,
           const ExplorationOptions& exploration, const SonarOptions& sonar,
           const MissionOptions& mission);
  ~Explorer();

  /// Where the vehicle started: home, and the place around which unknown space is taken for free.
  void SetStart(const Vec3& p_W) { SetStart(p_W, p_W); }
  /// The same of a flight that goes on with the map of earlier ones: where the first of them
  /// started, which is home, and where this one did. Both are such places.
  void SetStart(const Vec3& first_W, const Vec3& p_W);

  /// To be called with every pose. Returns the new plan when there is one. While `hold` tells a
  /// reason the vehicle stays where it is.
  const Plan* Update(const OccupancyMap& map, const Pose3& X_WB, Time now, int submaps,
                     const std::string& hold = {});

  /// Where the submaps are now. The way that the vehicle came moves with them: each part with the
  /// newest submap that there was then, relative to which the vehicle knew best where it was.
  void SetSubmaps(const std::map<int, Pose3>& X_WM);

  /// Known volume inside the exploration box, by every third voxel on each axis [m^3].
  double ExploredVolume(const OccupancyMap& map) const;

  /// The plan in force; nullptr before the first.
  const Plan* plan() const { return plan_ ? &*plan_ : nullptr; }
  ExplorerState state() const { return state_; }
  /// nothing_to_gain, max_submaps, max_duration, max_distance, stuck, or what EndWith() was told;
  /// empty while exploring.
  const std::string& end_reason() const { return end_reason_; }
  /// Why it stays where it is, as Update() was told; empty while it does not.
  const std::string& hold() const { return hold_; }
  /// What was left when nothing was left to gain; nothing before, and after other ends.
  const Unseen& unseen() const { return unseen_; }
  /// Whether the vehicle has come home in the end.
  bool is_home() const { return is_home_; }

  /// Goes on by other rules and in another box. What the planner remembers of views is lost.
  void SetRules(const PlannerOptions& options, const ExplorationOptions& exploration);

  /// What is worth being seen again, instead of what was.
  void SetRevisits(std::vector<RevisitPlace> places) { revisits_->Offer(std::move(places)); }

  /// Ends the exploration: goes home, or stays when `goes_home` is false.
  void EndWith(const std::string& reason, bool goes_home);

 private:
  enum class PlanKind {
    kPath,     ///< Tested while it is flown.
    kWayBack,  ///< Out of a place that the map has closed; tested by WayBackChecker().
    kHold,     ///< Stay for a while.
    kSearch,   ///< Stay until the planner has looked at all places.
  };

  /// Of the clearances, that a way back keeps.
  struct WayBackShares {
    double from_sure = 1;    ///< From what is surely where the map shows it.
    double from_unsure = 1;  ///< From all else.
  };

  /// Where the vehicle was.
  struct Passed {
    Waypoint at;
    int submap = -1;  ///< The newest there was then; -1: none.
    Pose3 X_MB = Pose3::Identity();
  };

  /// On the way to a submap's place, or there.
  struct Visit {
    RevisitPlace place;
    ExplorerState then;
    Time began;
    std::optional<Time> arrived = {};
    int submaps_at_arrival = 0;
  };

  bool Hold(const std::string& reason, const Waypoint& at);
  void SpendBudget(const Waypoint& at, Time now, int submaps);
  void LookAround(const OccupancyMap& map, const Waypoint& at, Time now);
  /// What was looked into of the bubbles around the starts counts as free from then on.
  void LookIntoBubbles(const OccupancyMap& map, const Waypoint& at);
  bool NeedsPlan(const OccupancyMap& map, const Waypoint& at, Time now);
  bool HasReached(const Waypoint& at) const;
  bool IsBlocked(const OccupancyMap& map, const Waypoint& at) const;
  /// Unknown voxels at the end of the path when it was planned.
  int VisibleAtItsEnd() const;
  void MakePlan(const OccupancyMap& map, const Waypoint& at);
  bool Explore(const OccupancyMap& map, const Waypoint& at);
  /// Where the clearances confine it and the map is certain: with half of them, if that lets it
  /// out.
  bool FlyCloser(const OccupancyMap& map, const Waypoint& at);
  /// Along the path that was found, as far as it can be flown; false when that is nowhere.
  bool FlyToView(const OccupancyMap& map, const CollisionChecker& checker, ViewPlan found,
                 const Waypoint& at);
  /// Explores once more what was explored: whether that found a plan, nothing where there is still
  /// nothing to gain and all is as before.
  std::optional<bool> ExploreAgain(const OccupancyMap& map, const Waypoint& at);
  /// To a place nearby that offers all clearances.
  bool MakeRoom(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// Begins to see a submap again if that is worth its time.
  bool BeginVisit(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// To where the submap of the visit began.
  bool FlyToVisit(const OccupancyMap& map, const CollisionChecker& checker);
  /// The next path of a visit; false when there is none, or it is over.
  bool Localise(const OccupancyMap& map, const Waypoint& at);
  /// To and fro where the submap was made.
  void SetSweep(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  bool IsVisitOver() const;
  void EndVisit();
  FlightTime TimeSpent() const;
  bool Revisit(const OccupancyMap& map, const Waypoint& at);
  bool ReturnHome(const OccupancyMap& map, const Waypoint& at);
  bool FlyHome(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// A way to `goal`, or near it, and a turn to its heading. @pre routes_ was searched.
  std::optional<std::vector<Waypoint>> WayTo(const OccupancyMap& map,
                                             const CollisionChecker& checker, const Waypoint& goal,
                                             double near_m, HeadingSet headings);
  /// Whether to plan once more, at home, after nothing was left to gain elsewhere: on the way the
  /// map has moved, and the vehicle may know better where it is, so that passages are open that
  /// were not. Each time that less is unseen than the time before.
  bool IsWorthASecondLook();
  /// A way out of a place that offers too little room, by the given rules.
  using WayOut = bool (Explorer::*)(const OccupancyMap&, const Waypoint&, const CollisionChecker&);
  /// The same with as much clearance as can be had.
  bool LeaveTightPlace(const OccupancyMap& map, const Waypoint& at, WayOut way_out);
  /// Back along the way the vehicle came, to where there is room. History ends there then.
  bool BackOut(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& rules);
  /// To any place, not right here, that is roomy enough to plan from.
  bool Escape(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& checker);
  /// To any place with more room than here.
  bool StepAside(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& checker);
  /// An eighth of a turn, always the same way round as long as there is room for it: the fan is
  /// thin, and where all that it has shown is too little to go anywhere, the way out lies
  /// elsewhere.
  bool TurnOn(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& checker);
  /// To the roomiest place of a tree: roomier than here, at least `least_m` away and with
  /// `least_share` of the clearances.
  bool SetWayToRoom(const OccupancyMap& map, const Waypoint& at, const CollisionChecker& checker,
                    double least_share, double least_m);
  /// Flies a plan by the rules for ways out.
  void KeepInFlight(const WayBackShares& shares);
  /// A piece of the way home. Where all ways are closed by what is uncertain, it is better to go
  /// and see than to go back all the way, which takes long, and the longer, the more uncertain.
  bool FeelHome(const OccupancyMap& map, const Waypoint& at);
  std::optional<std::vector<Waypoint>> WayHome(const OccupancyMap& map,
                                               const CollisionChecker& checker, const Waypoint& at);
  /// Flies a path out of a tight place; steps that FlownStep() refuses as they are.
  void SetWayBack(const OccupancyMap& map, const CollisionChecker& checker,
                  const std::vector<Waypoint>& path, std::vector<TreeNode> tree = {},
                  int best = -1);
  /// The rules for ways out: what old submaps show where the vehicle is must be elsewhere.
  CollisionChecker WayBackChecker(const OccupancyMap& map, const Waypoint& at,
                                  const WayBackShares& shares) const;

  /// The rules with a share of the clearances, for a vehicle at `at`.
  CollisionChecker CheckerAt(const OccupancyMap& map, const Waypoint& at, double share) const;
  /// The largest share of the clearances that a place offers.
  double FreeShareAt(const OccupancyMap& map, const Waypoint& at) const;
  /// The rules to plan with from `at`; nothing where it offers too little.
  std::optional<CollisionChecker> CheckerFor(const OccupancyMap& map, const Waypoint& at);
  /// Whether those are the rules with all of the clearances.
  bool KeepsAllClearances() const;
  /// Keeps a share of the distance by which uncertainty makes clearances grow.
  void SetDistance(double share);
  /// Whether all of that distance closes most of the known water around the vehicle.
  bool IsWalledIn(const OccupancyMap& map, const Waypoint& at);
  /// Whether the map may be wrong by a voxel about where its walls are, seen from the vehicle.
  bool MayWallsBeElsewhere(const OccupancyMap& map) const;
  /// Whether no place but its own can be reached, by a map whose walls are not where they were.
  bool IsHemmedIn(const OccupancyMap& map, const CollisionChecker& checker, const Waypoint& at);
  /// Less distance for a while, if nothing is left to gain because the vehicle is walled in by it,
  /// and all again where there is room.
  bool KeepLessDistance(const OccupancyMap& map, const Waypoint& at);
  void KeepAllDistance(const OccupancyMap& map, const Waypoint& at);
  /// Whether any submap is not surely placed.
  bool IsUncertain(const OccupancyMap& map) const;

  void SetPlan(std::vector<Waypoint> path, PlanKind kind, std::vector<TreeNode> tree = {},
               int best = -1);
  Unseen CountUnseen(const OccupancyMap& map) const;
  void Finish(const Waypoint& at);
  void Remember(const Waypoint& at);
  Random NextRandom();

  PlannerOptions options_;
  MotionLimits limits_;
  SonarOptions sonar_;
  ExplorationOptions exploration_;
  Eigen::AlignedBox3d box_W_;
  MissionOptions mission_;
  CollisionChecker checker_;
  std::unique_ptr<ViewPlanner> planner_;
  std::unique_ptr<Routes> routes_;
  std::optional<RevisitChoice> revisits_;
  std::optional<Visit> visit_;
  double visits_s_ = 0;  // All that are over.

  ExplorerState state_ = ExplorerState::kExploring;
  std::string end_reason_, hold_;
  std::optional<Vec3> home_W_;
  Unseen unseen_;
  bool is_home_ = false;
  std::optional<Plan> plan_;
  PlanKind kind_ = PlanKind::kHold;
  Time now_, planned_at_, checked_at_;
  int submaps_ = 0, earlier_submaps_ = 0;  // Now, and when the flight began.
  std::optional<Time> looked_at_;
  std::vector<FreeBubble> bubbles_;  // Around the starts, the first one's at first.
  std::optional<Time> started_at_;
  double flown_m_ = 0;
  std::optional<Waypoint> last_at_;
  double flight_share_ = 0;         // Of the clearances, that the plan in flight must keep.
  double flight_unsure_share_ = 0;  // The same of a way back, from what is not surely there.
  std::int64_t plans_ = 0, trees_ = 0;
  std::vector<Passed> history_;  // The way the vehicle came, without what it went back again.
  std::map<int, Pose3> X_WM_;    // As SetSubmaps() was told.
  std::size_t next_revisit_ = 0;
  int done_at_ = 0;            // Submaps there were when nothing was left to gain.
  double distance_share_ = 1;  // Kept of what uncertainty asks for.
  int set_distance_at_ = 0;    // Submaps there were then.
  int failures_ = 0;           // Plans in a row that led nowhere, not even back.
  int ways_home_ = 0;          // Begun.
  int turn_sign_ = 1;          // The way round of the last TurnOn().
  double unseen_at_home_ = std::numeric_limits<double>::infinity();  // At the last second look.
};

}  // namespace vog
