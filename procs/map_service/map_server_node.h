#pragma once

#include "lib/messages/endpoint.h"
#include "lib/vogmap/vog_map.h"

namespace vog {

/// Answers questions about a map that does not change, such as one that was saved. In: MAP_REQUEST
/// (points, ray, box, snapshot). Out: MAP_REPLY, STATUS.
class MapServerNode {
 public:
  MapServerNode(Bus& bus, VogMap map, std::int64_t run_id);

 private:
  void OnRequest(Time now, const map_request_t& request);

  Endpoint endpoint_;
  VogMap map_;
  std::int64_t answers_ = 0;
};

}  // namespace vog
