#pragma once

#include "lib/occupancy/occupancy_map.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// Eq. 5 at one place: the log-odds of the submaps that know it, clamped once at the end. Sums are
/// of whole units, so that their order does not matter.
class LogOddsSum {
 public:
  /// Units of kUnknownUnits change nothing.
  void Add(LogOddsUnits units) {
    if (units == kUnknownUnits) return;
    units_ += units;
    is_known_ = true;
  }

  /// kUnknownLogOdds if nothing known was added.
  float Clamped(const SensorModel& model) const {
    return is_known_ ? ToLogOdds(model.Clamp(units_)) : kUnknownLogOdds;
  }

 private:
  int units_ = 0;
  bool is_known_ = false;
};

}  // namespace vog
