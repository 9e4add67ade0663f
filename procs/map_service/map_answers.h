#pragma once

#include "lib/vogmap/vog_map.h"
#include "vog/map_reply_t.hpp"
#include "vog/map_request_t.hpp"

namespace vog {

/// What `map` says to a request of kind points, ray, box or snapshot; any other, and one that makes
/// no sense, gets an `error`. The reply has no header and no poses_version yet.
map_reply_t AnswerTo(const map_request_t& request, const VogMap& map);

}  // namespace vog
