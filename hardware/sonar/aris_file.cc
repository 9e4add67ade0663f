#include "hardware/sonar/aris_file.h"

#include <algorithm>
#include <cmath>

#include "lib/scan/sonar.h"

namespace vog {
namespace {

constexpr std::uint32_t kMagic = 0x05464444;
constexpr std::size_t kHeaderBytes = 1024, kFrameHeaderBytes = 1024;
constexpr std::uint32_t kMostSamples = 1 << 16;

// Of the file's header.
constexpr std::size_t kMagicAt = 0, kFramesAt = 4, kBeamsAt = 16, kSamplesAt = 24;
// Of a frame's header.
constexpr std::size_t kFrameNumberAt = 0, kFrameTimeUsAt = 4, kVersionAt = 12,
                      kSonarTiltDegAt = 248, kPingModeAt = 436, kSamplePeriodUsAt = 452,
                      kRateHzAt = 460, kSoundSpeedAt = 464, kSamplesPerBeamAt = 468,
                      kStartDelayUsAt = 476, kIsReorderedAt = 516;

/// Beams of a ping mode; 0 if it is none.
int BeamsOfPingMode(std::uint32_t mode) {
  if (mode >= 1 && mode <= 2) return 48;
  if (mode >= 3 && mode <= 5) return 96;
  if (mode >= 6 && mode <= 8) return 64;
  if (mode >= 9 && mode <= 12) return 128;
  return 0;
}

std::uint32_t PingModeOfBeams(int beams) {
  return beams == 48 ? 1 : beams == 96 ? 3 : beams == 64 ? 6 : 9;
}

/// Samples that are not reordered lie as the pings of a frame came, which no file is known to have.
bool FitsLayout(const RecordingLayout& layout, ByteSpan header) {
  return BeamsOfPingMode(LoadLittle<std::uint32_t>(header, kPingModeAt)) == layout.beams &&
         LoadLittle<std::uint32_t>(header, kSamplesPerBeamAt) ==
             static_cast<std::uint32_t>(layout.bins) &&
         LoadLittle<std::uint32_t>(header, kIsReorderedAt) != 0;
}

void EncodeFrame(double rate_hz, const SonarFrame& frame, ByteVector& bytes) {
  constexpr double kSoundSpeed_m_s = 1500;
  const double us_per_m = 2e6 / kSoundSpeed_m_s;
  const double period_us = (frame.max_range_m - frame.min_range_m) * us_per_m / frame.bins;
  ByteVector header(kFrameHeaderBytes);
  StoreLittle(static_cast<std::uint32_t>(frame.sequence), kFrameNumberAt, header);
  StoreLittle(static_cast<std::uint64_t>(ToUtime(frame.time)), kFrameTimeUsAt, header);
  StoreLittle(kMagic, kVersionAt, header);
  StoreLittle(static_cast<float>(ToDegrees(frame.tilt_rad)), kSonarTiltDegAt, header);
  StoreLittle(PingModeOfBeams(frame.beams), kPingModeAt, header);
  StoreLittle(static_cast<std::uint32_t>(std::lround(period_us)), kSamplePeriodUsAt, header);
  StoreLittle(static_cast<float>(rate_hz), kRateHzAt, header);
  StoreLittle(static_cast<float>(kSoundSpeed_m_s), kSoundSpeedAt, header);
  StoreLittle(static_cast<std::uint32_t>(frame.bins), kSamplesPerBeamAt, header);
  StoreLittle(static_cast<std::uint32_t>(std::lround(frame.min_range_m * us_per_m)),
              kStartDelayUsAt, header);
  StoreLittle(std::uint32_t{1}, kIsReorderedAt, header);
  bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.insert(bytes.end(), frame.samples.begin(), frame.samples.end());
}

}  // namespace

std::optional<RecordingLayout> ArisLayout(ByteSpan bytes) {
  if (bytes.size() < kHeaderBytes + kFrameHeaderBytes ||
      LoadLittle<std::uint32_t>(bytes, kMagicAt) != kMagic)
    return std::nullopt;
  const ByteSpan first = bytes.subspan(kHeaderBytes);
  const auto samples = LoadLittle<std::uint32_t>(first, kSamplesPerBeamAt);
  const float rate_hz = LoadLittle<float>(first, kRateHzAt);
  RecordingLayout layout;
  layout.format = kArisFormat;
  layout.beams = BeamsOfPingMode(LoadLittle<std::uint32_t>(first, kPingModeAt));
  if (layout.beams == 0 || samples == 0 || samples > kMostSamples) return std::nullopt;
  layout.bins = static_cast<int>(samples);
  layout.rate_hz = std::isfinite(rate_hz) && rate_hz > 0 ? rate_hz : 0;
  layout.declared_frames = std::max(0, LoadLittle<std::int32_t>(bytes, kFramesAt));
  layout.header_bytes = kHeaderBytes;
  layout.frame_header_bytes = kFrameHeaderBytes;
  return layout;
}

std::optional<SonarFrame> DecodeArisFrame(const RecordingLayout& layout, ByteSpan bytes) {
  if (!FitsLayout(layout, bytes)) return std::nullopt;
  const double m_per_us = LoadLittle<float>(bytes, kSoundSpeedAt) * 1e-6 / 2;
  const double start_m = LoadLittle<std::uint32_t>(bytes, kStartDelayUsAt) * m_per_us;
  const double length_m =
      LoadLittle<std::uint32_t>(bytes, kSamplePeriodUsAt) * m_per_us * layout.bins;
  constexpr double kMostRange_m = 1000;
  if (!(start_m >= 0 && length_m > 0 && start_m + length_m < kMostRange_m)) return std::nullopt;
  const double tilt_rad = ToRadians(LoadLittle<float>(bytes, kSonarTiltDegAt));
  const ByteSpan samples = bytes.subspan(layout.frame_header_bytes);
  return SonarFrame{
      FromUtime(static_cast<std::int64_t>(LoadLittle<std::uint64_t>(bytes, kFrameTimeUsAt))),
      LoadLittle<std::uint32_t>(bytes, kFrameNumberAt),
      std::isfinite(tilt_rad) ? tilt_rad : 0,
      start_m,
      start_m + length_m,
      layout.beams,
      layout.bins,
      {samples.begin(), samples.end()}};
}

ByteVector EncodeAris(double rate_hz, std::span<const SonarFrame> frames) {
  ByteVector bytes(kHeaderBytes);
  StoreLittle(kMagic, kMagicAt, bytes);
  StoreLittle(static_cast<std::uint32_t>(frames.size()), kFramesAt, bytes);
  if (!frames.empty()) {
    StoreLittle(static_cast<std::uint32_t>(frames.front().beams), kBeamsAt, bytes);
    StoreLittle(static_cast<std::uint32_t>(frames.front().bins), kSamplesAt, bytes);
  }
  for (const SonarFrame& frame : frames) EncodeFrame(rate_hz, frame, bytes);
  return bytes;
}

}  // namespace vog
