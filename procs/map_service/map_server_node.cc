#include "procs/map_service/map_server_node.h"

#include "procs/map_service/map_answers.h"

namespace vog {

MapServerNode::MapServerNode(Bus& bus, VogMap map, std::int64_t run_id)
    : endpoint_(bus, "vog-map-server", run_id), map_(std::move(map)) {
  endpoint_.Subscribe(outputs::kMapRequest,
                      [this](Time now, const map_request_t& request) { OnRequest(now, request); });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["submaps"] = map_.size();
    counters["answers"] = answers_;
    return "ok";
  });
}

void MapServerNode::OnRequest(Time now, const map_request_t& request) {
  if (request.kind == "poses" || request.kind == "submaps") return;  // Of a map under way.
  ++answers_;
  endpoint_.PublishLarge(outputs::kMapReply, request.request_id, 0, AnswerTo(request, map_), now);
}

}  // namespace vog
