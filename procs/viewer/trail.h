#pragma once

#include <optional>
#include <vector>

#include "procs/viewer/frames.h"

namespace vog {

/// A path, thinned out: a point where the last one is `kStep_m` away or `kPause` old.
class Trail {
 public:
  static constexpr double kStep_m = 0.05;
  static constexpr Duration kPause = std::chrono::seconds(5);
  static constexpr std::size_t kPartPoints = 128;

  /// Takes `point`, which lies at `position_W_m`; false when it says nothing new.
  bool Add(const TrailPoint& point, const Vec3& position_W_m) {
    const bool is_far = !last_ || (position_W_m - last_W_).norm() >= kStep_m;
    if (!is_far && point.time - *last_ < kPause) return false;
    last_ = point.time;
    last_W_ = position_W_m;
    if (part_.size() == kPartPoints) {
      // The next part begins where this one ends.
      part_ = {part_.back()};
      ++parts_;
    }
    part_.push_back(point);
    return true;
  }

  /// The newest part of the path, and its number.
  const std::vector<TrailPoint>& part() const { return part_; }
  int part_number() const { return parts_; }

 private:
  std::vector<TrailPoint> part_;
  int parts_ = 0;
  std::optional<Time> last_;
  Vec3 last_W_ = Vec3::Zero();
};

}  // namespace vog
