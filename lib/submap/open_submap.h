#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "lib/scan/scan.h"
#include "lib/submap/scan_inserter.h"
#include "lib/submap/sensor_model.h"

namespace vog {

/// The scans that no closed submap holds yet, as a grid: what a reader of the map shows until the
/// map service closes the next submap. Its frame M is the body's at the first of them.
class OpenSubmap {
 public:
  OpenSubmap(double voxel_size_m, const SensorModelOptions& model);

  /// Adds a scan. One of a new navigation segment starts the grid anew: the two cannot be placed
  /// relative to each other here.
  void Add(const RegisteredScan& registered);

  /// Forgets the scans up to `time`, which a closed submap now holds, and builds the rest anew.
  void ForgetUpTo(Time time);

  /// nullptr without any scan.
  const BrickGrid* grid() const { return grid_ ? &*grid_ : nullptr; }
  /// Grows whenever the grid is another one or has grown.
  std::int64_t revision() const { return revision_; }
  /// Odometry of the frame M. @pre grid() != nullptr.
  const OdometrySample& base() const { return scans_.front().odometry; }

 private:
  void Insert(const RegisteredScan& registered);

  double voxel_size_m_;
  SensorModel model_;
  std::deque<RegisteredScan> scans_;
  std::int64_t revision_ = 0;
  std::optional<BrickGrid> grid_;
  std::optional<ScanInserter> inserter_;
};

}  // namespace vog
