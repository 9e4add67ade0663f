#pragma once

#include <map>
#include <memory>
#include <optional>

#include "lib/base/config.h"
#include "lib/messages/convert.h"
#include "lib/messages/submap_receiver.h"
#include "lib/slam/slam.h"
#include "lib/submap/submap_builder.h"

namespace vog {

struct SlamNodeSettings {
  SlamSettings slam;
  SubmapOptions submap;
  DriftOptions drift;
  std::int64_t run_id = 0;

  /// Mode vog-no-lc switches loop closures off.
  static SlamNodeSettings From(const Config& config);
};

/// Runs submap SLAM on the submaps that the map service closes, in the order of their numbers, and
/// tells where the vehicle is on the newest solution. In: SUBMAP, MAP_STATUS, NAV, MAP_REQUEST
/// (poses). Out: SUBMAP_POSES, GRAPH, REVISITS, POSE, MAP_REQUEST, STATUS.
class SlamNode {
 public:
  SlamNode(Bus& bus, const SlamNodeSettings& settings);

 private:
  /// What POSE can stand on: a submap's base, or what stands in for one.
  struct Anchor {
    OdometrySample odometry;
    Pose3 X_WM;
    Mat6 covariance_WM;
    Mat3 since;  // Covariance of (x, y, yaw) of its motion since the newest closed submap's base.
  };
  /// Where the vehicle was last.
  struct Last {
    Anchor anchor;
    OdometrySample odometry;
  };

  void OnSubmap(const SubmapPtr& submap);
  void OnReset();
  void OnMapStatus(const map_status_t& status);
  void OnNav(const nav_t& message);
  void PublishSolution(Time time);
  Anchor AnchorAt(SubmapId id) const;
  /// The edge's end.
  static Anchor Beyond(const Anchor& anchor, const OdometryEdge& edge,
                       const OdometrySample& odometry);
  std::optional<Anchor> AnchorFor(const OdometrySample& sample) const;
  /// The base of a submap of the segment.
  std::optional<Anchor> BaseIn(std::int64_t segment) const;
  /// For a new segment, on from where the vehicle was last.
  std::optional<Anchor> StandInFor(const OdometrySample& sample) const;

  SlamNodeSettings settings_;
  Endpoint endpoint_;
  std::unique_ptr<Slam> slam_;
  std::map<SubmapId, SubmapPtr> waiting_;        // Arrived before their predecessors.
  std::map<SubmapId, OdometrySample> odometry_;  // Of the bases in the graph.
  SubmapId first_ = 0;  // Of this flight: those before tell nothing of where the vehicle is now.
  std::optional<SubmapBase> open_;
  std::optional<Last> last_;
  std::int64_t version_ = 0;  // Grows over resets, too.
  revisits_t revisits_{};     // Of the version that it tells.
  Time newest_;
  SubmapReceiver receiver_;
};

}  // namespace vog
