#pragma once

#include "hardware/sonar/didson_header.h"
#include "lib/base/random.h"

namespace vog {

/// A frame of the vehicle's usual window, 2.25 to 11.25 m at high frequency, with random samples.
inline SonarFrame RandomSonarFrame(int beams, int index) {
  Random random(1, "frame", static_cast<std::uint64_t>(index));
  const double scale = beams == 96 ? 1 : 2;
  SonarFrame frame{FromUtime(1'468'966'347'000'000 + 100'000 * index),
                   index,
                   0.25,
                   scale * 2.25,
                   scale * 2.25 + (beams == 96 ? 9 : 36),
                   beams,
                   kDidsonBins,
                   {}};
  for (int i = 0; i < beams * kDidsonBins; ++i)
    frame.samples.push_back(static_cast<std::uint8_t>(random.Index(256)));
  return frame;
}

inline DidsonFrame RandomDidsonFrame(int beams, int index) {
  return *FromSonarFrame(RandomSonarFrame(beams, index));
}

}  // namespace vog
