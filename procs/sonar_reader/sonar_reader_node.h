#pragma once

#include <memory>

#include "hardware/link/link.h"
#include "hardware/sonar/sonar_link_options.h"
#include "lib/base/config.h"
#include "lib/bus/stopwatch.h"
#include "lib/messages/endpoint.h"
#include "lib/scan/range_detector.h"
#include "lib/scan/sonar.h"

namespace vog {

struct SonarReaderSettings {
  SonarOptions sonar;
  RangeDetectorOptions range_detector;
  SonarLinkOptions sonar_link;
  std::int64_t run_id = 0;

  static SonarReaderSettings From(const Config& config);
};

/// Turns what the sonar says into scans: finds the ranges in intensity frames, and decides which
/// silent beams are sure. Frames that come over a link are told as messages, which a log keeps,
/// before they are heard like those of others; so are those of HAUVs' logs. In: SONAR_RETURNS,
/// SONAR_FRAME, HAUV_DIDSON_FRAME. Out: SCAN, STATUS; with a link or the latter also SONAR_FRAME.
class SonarReaderNode {
 public:
  /// `link` may be none.
  SonarReaderNode(Bus& bus, const SonarReaderSettings& settings,
                  std::unique_ptr<ByteLink> link = nullptr);

 private:
  void StepLink();
  void OnHauvFrame(Bytes bytes);
  void Tell(const std::optional<SonarFrame>& frame);
  void CountLink(std::map<std::string, std::int64_t>& counters) const;
  void OnReturns(const sonar_returns_t& message);
  void OnFrame(const sonar_frame_t& message);
  void PublishScan(const Scan& scan);

  SonarReaderSettings settings_;
  std::vector<double> bearings_rad_;
  Endpoint endpoint_;
  std::unique_ptr<ByteLink> link_;
  DidsonStream stream_;
  std::vector<std::uint8_t> datagram_;
  std::int64_t other_windows_ = 0;
  Stopwatch since_start_;
  bool has_told_scan_ = false;    // Since the last STATUS.
  std::int64_t other_beams_ = 0;  // Records with a number of beams that the options do not know.
};

}  // namespace vog
