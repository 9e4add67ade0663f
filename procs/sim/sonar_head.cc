#include "procs/sim/sonar_head.h"

#include "lib/base/errors.h"

namespace vog {

void SonarHead::Tell(const std::vector<SonarFrame>& frames) {
  for (const SonarFrame& frame : frames) {
    const auto didson = FromSonarFrame(frame);
    if (!didson)
      throw UsageError(
          "sim_sonar_link: a DIDSON has 96 or 48 beams, 512 bins, and windows such as "
          "sonar.min_range_m 0.375 to sonar.max_range_m 9.375, or 2.25 to 11.25");
    const auto datagrams = EncodeDatagrams(packing_, *didson, sequence_);
    for (const ByteVector& datagram : datagrams) link_->Write(datagram);
    sequence_ = static_cast<std::uint16_t>(sequence_ + datagrams.size());
  }
}

}  // namespace vog
