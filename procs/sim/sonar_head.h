#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hardware/link/open_link.h"
#include "hardware/sonar/sonar_link_options.h"
#include "lib/scan/sonar_records.h"

namespace vog {

/// The simulated sonar's socket: sends frames as a DIDSON does.
class SonarHead {
 public:
  /// @throws UsageError for a bad URL.
  explicit SonarHead(const SonarLinkOptions& options)
      : packing_(options.packing), link_(OpenByteLink({options.url})) {}

  /// @throws UsageError where a DIDSON has no such window, beams or bins.
  void Tell(const std::vector<SonarFrame>& frames);
  void Step(Time steady) { link_->Step(steady); }
  std::int64_t dropped() const { return link_->counters().dropped; }

 private:
  DidsonPacking packing_;
  std::unique_ptr<ByteLink> link_;
  std::uint16_t sequence_ = 0;
};

}  // namespace vog
