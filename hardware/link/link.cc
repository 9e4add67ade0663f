#include "hardware/link/link.h"

namespace vog {

void CountLink(const Link& link, std::map<std::string, std::int64_t>& counters) {
  counters["link_reconnects"] = link.counters().reconnects;
  counters["link_dropped"] = link.counters().dropped;
  counters["link_errors"] = link.counters().errors;
}

}  // namespace vog
