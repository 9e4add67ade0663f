#pragma once

#include "lib/base/config.h"
#include "lib/messages/endpoint.h"
#include "lib/messages/submap_receiver.h"
#include "procs/viewer/page_server.h"
#include "procs/viewer/view_model.h"

namespace vog {

struct ViewerSettings {
  ViewerOptions viewer;
  ViewSettings view;
  std::int64_t run_id = 0;

  static ViewerSettings From(const Config& config);
};

/// Shows the run to people: hears what all processes say and serves it as a page.
/// In: SUBMAP, MAP_STATUS, SUBMAP_POSES, GRAPH, POSE, NAV, SCAN, TRUTH, PLAN, MISSION_STATUS,
/// STATUS of all. Out: MAP_REQUEST, OPERATOR, STATUS.
class ViewerNode {
 public:
  ViewerNode(Bus& bus, const ViewerSettings& settings);

  /// Serves the pages, and looks at what has changed; to be called often.
  void Step(Time now);

  ViewModel& model() { return model_; }
  const Endpoint::Counts& counts() const { return endpoint_.counts(); }
  PageServer& server() { return server_; }

 private:
  void Subscribe();
  void OnSubmapPoses(const submap_poses_t& message);
  void OnEstimate(Time now, const pose_estimate_t& message);
  void AskForMissingPoses(Time now);
  std::vector<Frame> OnRequest(const std::string& text);
  Frame Refuse(const std::string& why);
  std::vector<Frame> StateAt(double utime_us) const;
  Frame Order(const std::string& command);

  ViewerSettings settings_;
  Endpoint endpoint_;
  ViewModel model_;
  SubmapReceiver receiver_;
  PageServer server_;
  std::int64_t pose_version_ = 0, poses_version_ = 0, graph_version_ = 0;
  Time now_;
  std::int64_t refused_ = 0;  // Requests that make no sense.
};

}  // namespace vog
