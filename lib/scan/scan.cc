#include "lib/scan/scan.h"

#include <algorithm>
#include <optional>

#include "lib/scan/sonar.h"

namespace vog {

std::vector<Vec3> EndPoints_B(const Scan& scan) {
  std::vector<Vec3> points_B;
  for (const Beam& beam : scan.beams) {
    if (beam.status == BeamStatus::kReturn)
      points_B.push_back(scan.X_BS * (beam.range_m * BeamDirection(beam.bearing_rad)));
  }
  return points_B;
}

void ClassifySilentBeams(int guard_beams, std::vector<Beam>& beams) {
  const int count = static_cast<int>(beams.size());
  // Number of the last beam with an echo up to each beam, seen from either end.
  std::vector<int> distance(beams.size(), count);
  const auto sweep = [&](int from, int to, int step) {
    std::optional<int> last;
    for (int i = from; i != to; i += step) {
      if (beams[i].status == BeamStatus::kReturn) last = i;
      if (last) distance[i] = std::min(distance[i], std::abs(i - *last));
    }
  };
  sweep(0, count, 1);
  sweep(count - 1, -1, -1);
  for (int i = 0; i < count; ++i) {
    if (beams[i].status != BeamStatus::kReturn)
      beams[i].status = distance[i] > guard_beams ? BeamStatus::kClear : BeamStatus::kUncertain;
  }
}

}  // namespace vog
