#pragma once

#include "lib/base/config.h"
#include "lib/messages/endpoint.h"
#include "lib/scan/range_detector.h"
#include "lib/scan/sonar.h"

namespace vog {

struct SonarReaderSettings {
  SonarOptions sonar;
  RangeDetectorOptions range_detector;
  std::int64_t run_id = 0;

  static SonarReaderSettings From(const Config& config);
};

/// Turns what the sonar says into scans: finds the ranges in intensity frames, and decides which
/// silent beams are sure. In: SONAR_RETURNS, SONAR_FRAME. Out: SCAN, STATUS.
class SonarReaderNode {
 public:
  SonarReaderNode(Bus& bus, const SonarReaderSettings& settings);

 private:
  void OnReturns(const sonar_returns_t& message);
  void OnFrame(const sonar_frame_t& message);
  void PublishScan(const Scan& scan);

  SonarReaderSettings settings_;
  std::vector<double> bearings_rad_;
  Endpoint endpoint_;
  std::int64_t other_beams_ = 0;  // Records with a number of beams that the options do not know.
};

}  // namespace vog
