#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/status/system_view.h"

namespace vog {

/// The system as lines for people, without control characters.
std::vector<std::string> RenderText(const SystemView& view, Time now);

/// The same for programs; ages in seconds.
nlohmann::ordered_json RenderJson(const SystemView& view, Time now);

}  // namespace vog
