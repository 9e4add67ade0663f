#pragma once

#include <string>

#include "hardware/sonar/didson_stream.h"
#include "lib/base/config.h"

namespace vog {

/// Where the sonar is: tables [sonar_link] of the reader and [sim_sonar_link] of the simulator,
/// which stands at the other end.
struct SonarLinkOptions {
  std::string url;
  DidsonPacking packing = DidsonPacking::kHuls3;

  void Visit(OptionsVisitor& v) {
    v("url", url, "udp:PORT, or udp:PORT?peer=HOST:PORT; empty: messages take its place");
    v("packing", packing,
      Names<DidsonPacking>{{DidsonPacking::kHuls3, "huls3"}, {DidsonPacking::kHauv1b, "hauv1b"}},
      "how the simulator spreads a frame over datagrams; the reader understands both");
  }
};

}  // namespace vog
