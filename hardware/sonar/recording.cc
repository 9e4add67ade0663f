#include "hardware/sonar/recording.h"

#include <algorithm>

#include "hardware/sonar/aris_file.h"
#include "hardware/sonar/ddf_file.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

RecordingLayout LayoutOf(ByteSpan bytes) {
  if (const auto layout = DdfLayout(bytes)) return *layout;
  if (const auto layout = ArisLayout(bytes)) return *layout;
  throw UsageError("not a sonar recording (.ddf version 3 or 4, .aris), or its header is damaged");
}

}  // namespace

SonarRecording::SonarRecording(ByteSpan bytes) : bytes_(bytes), layout_(LayoutOf(bytes)) {
  constexpr std::size_t kMostFrames = 1 << 30;
  size_ = static_cast<int>(
      std::min(kMostFrames, (bytes.size() - layout_.header_bytes) / layout_.frame_bytes()));
  if (size_ == 0) throw UsageError("the recording ends before its first frame");
}

std::optional<SonarFrame> SonarRecording::Frame(int index) const {
  const ByteSpan frame =
      bytes_.subspan(layout_.header_bytes + index * layout_.frame_bytes(), layout_.frame_bytes());
  return layout_.format == kArisFormat ? DecodeArisFrame(layout_, frame)
                                       : DecodeDdfFrame(layout_, frame);
}

std::string SonarRecording::Fault() const {
  int damaged = 0;
  for (int i = 0; i < size_; ++i) damaged += !Frame(i);
  const std::size_t rest = bytes_.size() - layout_.header_bytes - size_ * layout_.frame_bytes();
  std::string fault;
  const auto add = [&](const std::string& text) { fault += (fault.empty() ? "" : ", ") + text; };
  if (damaged > 0) add(std::to_string(damaged) + " frames with a damaged header left out");
  if (rest > 0) add("ends within a frame, " + std::to_string(rest) + " bytes left out");
  if (size_ < layout_.declared_frames)
    add(std::to_string(size_) + " of " + std::to_string(layout_.declared_frames) + " frames there");
  return fault;
}

}  // namespace vog
