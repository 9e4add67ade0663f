#pragma once

#include <optional>
#include <string>

#include "hardware/frames/bytes.h"
#include "lib/scan/sonar_records.h"

namespace vog {

/// What the frames of a recording share.
struct RecordingLayout {
  std::string format;  ///< "DDF_03", "DDF_04", "DDF_05" (.aris).
  int beams = 0, bins = 0;
  double rate_hz = 0;                  ///< As the file says; 0 when it does not.
  int declared_frames = 0;             ///< As the file says.
  std::size_t header_bytes = 0;        ///< Before the first frame.
  std::size_t frame_header_bytes = 0;  ///< Before each frame's samples.

  std::size_t frame_bytes() const {
    return frame_header_bytes + static_cast<std::size_t>(beams) * bins;
  }
};

/// The frames of a .ddf or .aris file, each decoded when it is asked for. Looks at `bytes`, which
/// must outlive it.
class SonarRecording {
 public:
  /// @throws UsageError if the bytes are no recording, or end before its first frame.
  explicit SonarRecording(ByteSpan bytes);

  const RecordingLayout& layout() const { return layout_; }
  /// Frames that are there as a whole.
  int size() const { return size_; }
  /// Nothing when the frame's own header is damaged. @pre 0 <= index < size().
  std::optional<SonarFrame> Frame(int index) const;
  /// What of the file is missing or left out; empty for a good file. Looks at all frame headers.
  std::string Fault() const;

 private:
  ByteSpan bytes_;
  RecordingLayout layout_;
  int size_ = 0;
};

}  // namespace vog
