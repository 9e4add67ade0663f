#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace vog {

/// What a frame tells the page; the numbers are those of web/src/frames.js. The first ones are
/// binary, see frames.h; the others are JSON objects that name themselves in `k`.
enum class FrameKind : std::uint32_t {
  kSubmap = 1,
  kPoses,
  kScan,
  kEstimate,
  kOdometry,
  kTruth,
  kGraph,
  kTrail,
  kFrontier,
  kFirstText = 100,
  kHello,
  kLoading,
  kPlan,
  kMission,
  kHealth,
  kSeries,
};

/// A message to pages, as its bytes travel: made once, shared by all who still have to send it.
struct Frame {
  std::shared_ptr<const std::string> bytes;
  bool is_text = false;
};

inline Frame BinaryFrame(std::string bytes) {
  return {std::make_shared<const std::string>(std::move(bytes)), false};
}
inline Frame TextFrame(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), true};
}

}  // namespace vog
