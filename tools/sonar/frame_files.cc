#include "tools/sonar/frame_files.h"

#include <stb/stb_image.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <memory>

#include "lib/base/errors.h"
#include "lib/base/log.h"

namespace vog {
namespace {

constexpr SonarWindow kUsualWindow = {2.25, 11.25};
constexpr int kMostBeams = 1024, kMostBins = 1 << 16;

std::string EndingOf(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return ending.empty() ? ending : ending.substr(1);
}

bool IsOfFormat(const std::filesystem::path& file, const std::string& format) {
  const std::string ending = EndingOf(file);
  if (!format.empty()) return ending == format;
  return ending == "pgm" || ending == "png" || ending == "ddf" || ending == "aris";
}

bool IsRecording(const std::filesystem::path& file, const FrameReading& reading) {
  const std::string format = reading.format.empty() ? EndingOf(file) : reading.format;
  return format == "ddf" || format == "aris";
}

std::shared_ptr<const MappedFile> MapFile(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) throw UsageError(file.string() + ": is a folder");
  auto mapped = MappedFile::Open(file);
  if (!mapped) throw UsageError(file.string() + ": cannot be read, or is empty");
  return mapped;
}

ByteSpan BytesOf(const MappedFile& file) {
  return {reinterpret_cast<const std::uint8_t*>(file.bytes().data()), file.bytes().size()};
}

SonarRecording OpenRecording(const std::filesystem::path& file, const MappedFile& mapped) {
  try {
    return SonarRecording(BytesOf(mapped));
  } catch (const UsageError& error) {
    throw UsageError(file.string() + ": " + error.what());
  }
}

SonarFrame ReadImage(const std::filesystem::path& file, const SonarWindow& window) {
  const auto mapped = MapFile(file);
  const ByteSpan bytes = BytesOf(*mapped);
  const auto refuse = [&](const std::string& why) { throw UsageError(file.string() + ": " + why); };
  if (bytes.size() > std::numeric_limits<int>::max()) refuse("too large for an image");
  const int size = static_cast<int>(bytes.size());
  int beams = 0, bins = 0, channels = 0;
  if (!stbi_info_from_memory(bytes.data(), size, &beams, &bins, &channels))
    refuse("not a PGM or PNG image of 8 bits a sample");
  if (beams > kMostBeams || bins > kMostBins)
    refuse(std::to_string(beams) + " x " + std::to_string(bins) +
           " pixels; a frame has a column a beam, at most " + std::to_string(kMostBeams));
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(bytes.data(), size, &beams, &bins, &channels, 1), stbi_image_free);
  if (!pixels) refuse("the image is damaged");
  return {.time = {},
          .min_range_m = window.min_range_m,
          .max_range_m = window.max_range_m,
          .beams = beams,
          .bins = bins,
          .samples = {pixels.get(), pixels.get() + static_cast<std::size_t>(beams) * bins}};
}

void ForEachRecordedFrame(const std::filesystem::path& path, const FrameReading& reading,
                          const FrameVisitor& visit) {
  const RecordingFile file(path);
  const SonarRecording& recording = file.recording();
  if (const std::string fault = recording.Fault(); !fault.empty())
    LogLine(path.string() + ": " + fault);
  for (int i = 0; i < recording.size(); ++i) {
    auto frame = recording.Frame(i);
    if (!frame) continue;
    if (reading.window) {
      frame->min_range_m = reading.window->min_range_m;
      frame->max_range_m = reading.window->max_range_m;
    }
    visit(path.filename().string() + ":" + std::to_string(i), *frame);
  }
}

}  // namespace

std::vector<std::filesystem::path> FrameFiles(const std::filesystem::path& path,
                                              const FrameReading& reading) {
  if (!std::filesystem::exists(path)) throw UsageError(path.string() + ": no such file or folder");
  if (!std::filesystem::is_directory(path)) {
    if (reading.format.empty() && !IsOfFormat(path, ""))
      throw UsageError(path.string() + ": unknown ending; say what it is with --format");
    return {path};
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.is_regular_file() && IsOfFormat(entry.path(), reading.format))
      files.push_back(entry.path());
  }
  if (files.empty()) {
    throw UsageError(path.string() + ": no " +
                     (reading.format.empty() ? ".pgm, .png, .ddf or .aris" : "." + reading.format) +
                     " file in this folder");
  }
  std::sort(files.begin(), files.end());
  return files;
}

void ForEachFrame(const std::filesystem::path& file, const FrameReading& reading,
                  const FrameVisitor& visit) {
  if (IsRecording(file, reading))
    ForEachRecordedFrame(file, reading, visit);
  else
    visit(file.filename().string(), ReadImage(file, reading.window.value_or(kUsualWindow)));
}

RecordingFile::RecordingFile(const std::filesystem::path& file)
    : file_(MapFile(file)), recording_(OpenRecording(file, *file_)) {}

std::string ToPgm(const SonarFrame& frame) {
  return "P5\n" + std::to_string(frame.beams) + " " + std::to_string(frame.bins) + "\n255\n" +
         std::string(AsText(frame.samples));
}

}  // namespace vog
