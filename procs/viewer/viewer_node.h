#pragma once

#include "lib/base/config.h"
#include "lib/foxglove/proto_converter.h"
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

/// Shows the run to people: hears what all processes say and serves it as a page, and to clients of
/// Foxglove's protocol. In: all channels. Out: MAP_REQUEST, OPERATOR, STATUS.
class ViewerNode {
 public:
  ViewerNode(Bus& bus, const ViewerSettings& settings);

  /// Serves the pages, and looks at what has changed; to be called often.
  void Step(Time now);

  ViewModel& model() { return model_; }
  /// Shows a map without its run. The times of `places` and `graph` are those of their headers.
  void ShowMap(const std::vector<SubmapPtr>& submaps, const submap_poses_t& places,
               const graph_t& graph);
  /// All of the log has been read: clients of Foxglove's protocol are shown its end.
  void EndLog();
  const Endpoint::Counts& counts() const { return endpoint_.counts(); }
  PageServer& server() { return server_; }

 private:
  /// The newest message of a channel and sender.
  struct HeardInLog {
    std::int64_t number = 0;
    Time time;
    std::vector<std::uint8_t> bytes;
  };

  void Subscribe();
  /// To clients of Foxglove's protocol; of a log, what later messages replace is not converted.
  void PassOn(Time now, const std::string& channel, const std::string& sender, Bytes bytes);
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
  FoxgloveFeed feed_;
  ProtoConverter converter_{[this](const ProtoMessage& message) { feed_.Post(message); },
                            ProtoConverter::SubmapsFrom::kAddSubmap};
  SubmapPtr new_submap_;                                              // Not passed on yet.
  std::map<std::pair<std::string, std::string>, HeardInLog> of_log_;  // By channel and sender.
  std::int64_t heard_in_log_ = 0;
  SubmapReceiver receiver_;
  PageServer server_;
  std::int64_t pose_version_ = 0, poses_version_ = 0, graph_version_ = 0;
  Time now_;
  std::int64_t refused_ = 0;  // Requests that make no sense.
};

}  // namespace vog
