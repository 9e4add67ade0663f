#include <gtest/gtest.h>

#include <cstdlib>

#include "hardware/sonar/aris_file.h"
#include "hardware/sonar/ddf_file.h"
#include "hardware/sonar/didson_stream.h"
#include "hardware/sonar/frames_testing.h"
#include "lib/base/errors.h"

// Damaged headers, datagrams and files: nothing crashes, and what comes out is a frame or nothing.
// VOG_FUZZ_INPUTS sets the number of inputs of each test.

namespace vog {
namespace {

int Inputs() {
  const char* const given = std::getenv("VOG_FUZZ_INPUTS");
  return given ? std::max(1, std::atoi(given)) : 7000;
}

/// Flips bits, sets words to extreme values, cuts, lengthens or repeats; most damage is in headers.
ByteVector Damage(ByteVector bytes, Random& random) {
  static constexpr std::uint32_t kExtremes[] = {0,          1,          0x7fffffff,
                                                0x80000000, 0xffffffff, 0x7fc00000};
  const auto place = [&](std::size_t room) {
    const std::size_t end =
        random.Chance(0.8) ? std::min<std::size_t>(bytes.size(), 2200) : bytes.size();
    return end <= room ? std::size_t{0}
                       : static_cast<std::size_t>(random.Index(static_cast<int>(end - room)));
  };
  for (int changes = random.Index(6); changes >= 0 && bytes.size() > 4; --changes) {
    switch (random.Index(5)) {
      case 0:
        bytes[place(0)] ^= static_cast<std::uint8_t>(1 << random.Index(8));
        break;
      case 1:
        StoreLittle(kExtremes[random.Index(6)], place(4) / 4 * 4, bytes);
        break;
      case 2:
        bytes[place(0)] = static_cast<std::uint8_t>(random.Index(256));
        break;
      case 3:
        if (random.Chance(0.3)) bytes.resize(random.Index(static_cast<int>(bytes.size())));
        break;
      default:
        if (random.Chance(0.2)) bytes.resize(bytes.size() + random.Index(100));
    }
  }
  return bytes;
}

void ExpectSane(const SonarFrame& frame) {
  EXPECT_GE(frame.min_range_m, 0);
  EXPECT_GT(frame.max_range_m, frame.min_range_m);
  EXPECT_LT(frame.max_range_m, 1000);
  EXPECT_EQ(frame.samples.size(), static_cast<std::size_t>(frame.beams) * frame.bins);
  EXPECT_EQ(frame.tilt_rad, frame.tilt_rad);
}

TEST(DecodersFuzzTest, Headers) {
  const ByteVector good = EncodeDidsonHeader(RandomDidsonFrame(96, 0).header);
  for (int i = 0; i < 10 * Inputs(); ++i) {
    Random random(1, "headers", static_cast<std::uint64_t>(i));
    ByteVector bytes = Damage(good, random);
    bytes.resize(kDidsonHeaderBytes);
    const DidsonHeader header = DecodeDidsonHeader(bytes);
    TimeOf(header);
    const std::size_t samples = static_cast<std::size_t>(BeamsOf(header)) * kDidsonBins;
    if (const auto frame = ToSonarFrame({header, ByteVector(samples)})) ExpectSane(*frame);
  }
}

TEST(DecodersFuzzTest, Files) {
  std::vector<SonarFrame> short_frames;
  for (int i = 0; i < 3; ++i) {
    short_frames.push_back(RandomSonarFrame(48, i));
    short_frames.back().bins = 20;
    short_frames.back().samples.resize(48 * 20);
  }
  const DidsonFrame frames[] = {RandomDidsonFrame(48, 0), RandomDidsonFrame(48, 1)};
  const ByteVector files[] = {EncodeDdf(DdfVersion::k3, 10, frames),
                              EncodeDdf(DdfVersion::k4, 10, frames), EncodeAris(5, short_frames)};
  for (int i = 0; i < Inputs(); ++i) {
    Random random(1, "files", static_cast<std::uint64_t>(i));
    const ByteVector bytes = Damage(files[i % 3], random);
    try {
      const SonarRecording recording(bytes);
      EXPECT_LT(recording.Fault().size(), 200u);
      for (int k = 0; k < std::min(recording.size(), 100); ++k) {
        if (const auto frame = recording.Frame(k)) ExpectSane(*frame);
      }
    } catch (const UsageError&) {  // No recording any more.
    }
  }
}

TEST(DecodersFuzzTest, Datagrams) {
  DidsonStream dut;
  std::vector<ByteVector> datagrams;
  for (const DidsonPacking packing : {DidsonPacking::kHuls3, DidsonPacking::kHauv1b}) {
    for (const int beams : {96, 48}) {
      for (ByteVector& datagram : EncodeDatagrams(packing, RandomDidsonFrame(beams, 0), 0))
        datagrams.push_back(std::move(datagram));
    }
  }
  std::uint16_t sequence = 0;
  for (int i = 0; i < Inputs(); ++i) {
    Random random(1, "datagrams", static_cast<std::uint64_t>(i));
    ByteVector bytes = datagrams[i % datagrams.size()];
    StoreLittle(sequence++, 6, bytes);
    if (random.Chance(0.3)) bytes = Damage(std::move(bytes), random);
    if (const auto frame = dut.Add(bytes)) {
      if (const auto sonar_frame = ToSonarFrame(*frame)) ExpectSane(*sonar_frame);
    }
  }
  EXPECT_EQ(dut.counters().datagrams, Inputs());
  EXPECT_GT(dut.counters().frames, 0);
}

}  // namespace
}  // namespace vog
