#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hardware/sonar/didson_header.h"
#include "hardware/sonar/recording.h"
#include "lib/base/files.h"

namespace vog {

/// How frames are read from files.
struct FrameReading {
  std::string format;  ///< "pgm", "png", "ddf" or "aris"; empty: files of any of them.
  std::optional<SonarWindow> window;  ///< Images: default 2.25-11.25 m; recordings: their own.
};

/// What `file` is called when a frame of it is told of: an image's name, or a recording's with the
/// frame's number in the file, "dive.ddf:17".
using FrameVisitor = std::function<void(const std::string& file, const SonarFrame& frame)>;

/// The file itself, or the files of the format in a folder, in the order of their names.
/// @throws UsageError if there is none.
std::vector<std::filesystem::path> FrameFiles(const std::filesystem::path& path,
                                              const FrameReading& reading);

/// Visits the frames of a file. An image is a frame of 8-bit samples: a row a range bin, from near
/// to far, a column a beam; colours become grey. What of a recording is damaged is left out and
/// told on standard error. @throws UsageError naming the file if it is none of these.
void ForEachFrame(const std::filesystem::path& file, const FrameReading& reading,
                  const FrameVisitor& visit);

/// A file that holds a recording.
class RecordingFile {
 public:
  /// @throws UsageError naming the file if it cannot be read or is no recording.
  explicit RecordingFile(const std::filesystem::path& file);

  const SonarRecording& recording() const { return recording_; }

 private:
  std::shared_ptr<const MappedFile> file_;
  SonarRecording recording_;
};

/// The frame as an image that ForEachFrame reads: binary PGM (netpbm P5).
std::string ToPgm(const SonarFrame& frame);

}  // namespace vog
