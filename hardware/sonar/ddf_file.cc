#include "hardware/sonar/ddf_file.h"

#include <algorithm>
#include <cmath>

namespace vog {
namespace {

constexpr std::uint32_t kMagic3 = 0x03464444, kMagic4 = 0x04464444;

// Of the file's header.
constexpr std::size_t kMagicAt = 0, kFramesAt = 4, kRateAt = 8, kHighResolutionAt = 12,
                      kBeamsAt = 16, kBinsAt = 24;

std::size_t HeaderBytes(DdfVersion version) { return version == DdfVersion::k3 ? 512 : 1024; }
std::size_t FrameHeaderBytes(DdfVersion version) {
  return version == DdfVersion::k3 ? 256 : kDidsonHeaderBytes;
}

std::optional<DdfVersion> VersionOf(ByteSpan bytes) {
  if (bytes.size() < HeaderBytes(DdfVersion::k3)) return std::nullopt;
  const auto magic = LoadLittle<std::uint32_t>(bytes, kMagicAt);
  if (magic == kMagic3) return DdfVersion::k3;
  if (magic == kMagic4 && bytes.size() >= HeaderBytes(DdfVersion::k4)) return DdfVersion::k4;
  return std::nullopt;
}

}  // namespace

std::optional<RecordingLayout> DdfLayout(ByteSpan bytes) {
  const auto version = VersionOf(bytes);
  if (!version) return std::nullopt;
  RecordingLayout layout;
  layout.format = version == DdfVersion::k3 ? "DDF_03" : "DDF_04";
  layout.beams = LoadLittle<std::int32_t>(bytes, kBeamsAt);
  layout.bins = LoadLittle<std::int32_t>(bytes, kBinsAt);
  layout.rate_hz = LoadLittle<std::uint32_t>(bytes, kRateAt);
  layout.declared_frames = std::max(0, LoadLittle<std::int32_t>(bytes, kFramesAt));
  layout.header_bytes = HeaderBytes(*version);
  layout.frame_header_bytes = FrameHeaderBytes(*version);
  if ((layout.beams != 96 && layout.beams != 48) || layout.bins != kDidsonBins) return std::nullopt;
  return layout;
}

std::optional<SonarFrame> DecodeDdfFrame(const RecordingLayout& layout, ByteSpan bytes) {
  ByteVector header(kDidsonHeaderBytes);
  std::copy_n(bytes.begin(), layout.frame_header_bytes, header.begin());
  const ByteSpan samples = bytes.subspan(layout.frame_header_bytes);
  return ToSonarFrame({DecodeDidsonHeader(header), ByteVector(samples.begin(), samples.end())});
}

ByteVector EncodeDdf(DdfVersion version, double rate_hz, std::span<const DidsonFrame> frames) {
  ByteVector bytes(HeaderBytes(version));
  const int beams = frames.empty() ? 96 : BeamsOf(frames.front().header);
  StoreLittle(version == DdfVersion::k3 ? kMagic3 : kMagic4, kMagicAt, bytes);
  StoreLittle(static_cast<std::uint32_t>(frames.size()), kFramesAt, bytes);
  StoreLittle(static_cast<std::uint32_t>(std::lround(rate_hz)), kRateAt, bytes);
  StoreLittle(std::uint32_t{beams == 96}, kHighResolutionAt, bytes);
  StoreLittle(static_cast<std::uint32_t>(beams), kBeamsAt, bytes);
  StoreLittle(static_cast<std::uint32_t>(kDidsonBins), kBinsAt, bytes);
  for (const DidsonFrame& frame : frames) {
    const ByteVector header = EncodeDidsonHeader(frame.header);
    bytes.insert(bytes.end(), header.begin(),
                 header.begin() + static_cast<std::ptrdiff_t>(FrameHeaderBytes(version)));
    bytes.insert(bytes.end(), frame.samples.begin(), frame.samples.end());
  }
  return bytes;
}

}  // namespace vog
