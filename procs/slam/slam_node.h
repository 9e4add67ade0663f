#pragma once

#include <map>
#include <memory>
#include <optional>

#include "lib/base/config.h"
#include "lib/messages/convert.h"
#include "lib/messages/submap_receiver.h"
#include "lib/slam/slam.h"

namespace vog {

struct SlamNodeSettings {
  SlamSettings slam;
  std::int64_t run_id = 0;

  /// Mode vog-no-lc switches loop closures off.
  static SlamNodeSettings From(const Config& config);
};

/// Runs submap SLAM on the submaps that the map service closes, in the order of their numbers, and
/// tells where the vehicle is on the newest solution. In: SUBMAP, MAP_STATUS, NAV, MAP_REQUEST
/// (poses). Out: SUBMAP_POSES, GRAPH, POSE, MAP_REQUEST, STATUS.
class SlamNode {
 public:
  SlamNode(Bus& bus, const SlamNodeSettings& settings);

 private:
  /// A submap base that POSE can stand on.
  struct Anchor {
    OdometrySample odometry;
    Pose3 X_WM;
    Mat6 covariance_WM;
  };

  void OnSubmap(const SubmapPtr& submap);
  void OnReset();
  void OnMapStatus(const map_status_t& status);
  void OnNav(const nav_t& message);
  void PublishSolution(Time time);
  Anchor AnchorAt(SubmapId id) const;
  std::optional<Anchor> AnchorFor(std::int64_t segment) const;

  SlamSettings settings_;
  Endpoint endpoint_;
  std::unique_ptr<Slam> slam_;
  std::map<SubmapId, SubmapPtr> waiting_;        // Arrived before their predecessors.
  std::map<SubmapId, OdometrySample> odometry_;  // Of the bases in the graph.
  std::optional<SubmapBase> open_;
  std::int64_t version_ = 0;  // Grows over resets, too.
  Time newest_;
  SubmapReceiver receiver_;
};

}  // namespace vog
