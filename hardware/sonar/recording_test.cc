#include "hardware/sonar/recording.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "hardware/sonar/aris_file.h"
#include "hardware/sonar/ddf_file.h"
#include "hardware/sonar/frames_testing.h"
#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

constexpr int kFrames = 3;

ByteVector Ddf(DdfVersion version, int beams) {
  std::vector<DidsonFrame> frames;
  for (int i = 0; i < kFrames; ++i) frames.push_back(RandomDidsonFrame(beams, i));
  return EncodeDdf(version, 10, frames);
}

ByteVector Aris(int beams) {
  std::vector<SonarFrame> frames;
  for (int i = 0; i < kFrames; ++i) {
    SonarFrame frame = RandomSonarFrame(96, i);
    frame.beams = beams;
    frame.bins = 100;
    frame.samples.resize(static_cast<std::size_t>(beams) * frame.bins);
    frames.push_back(frame);
  }
  return EncodeAris(7.5, frames);
}

class DdfTest : public testing::TestWithParam<std::pair<DdfVersion, int>> {};

TEST_P(DdfTest, FramesComeBack) {
  const auto [version, beams] = GetParam();
  const ByteVector bytes = Ddf(version, beams);
  const SonarRecording recording(bytes);
  EXPECT_EQ(recording.layout().format, version == DdfVersion::k3 ? "DDF_03" : "DDF_04");
  EXPECT_EQ(recording.layout().rate_hz, 10);
  EXPECT_EQ(recording.Fault(), "");
  ASSERT_EQ(recording.size(), kFrames);
  for (int i = 0; i < kFrames; ++i) {
    const SonarFrame expected = RandomSonarFrame(beams, i);
    const auto frame = recording.Frame(i);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->sequence, i);
    EXPECT_EQ(frame->time, version == DdfVersion::k3 ? Time() : expected.time);
    EXPECT_DOUBLE_EQ(frame->max_range_m, expected.max_range_m);
    EXPECT_EQ(frame->samples, expected.samples);
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, DdfTest,
                         testing::Values(std::pair(DdfVersion::k3, 96),
                                         std::pair(DdfVersion::k3, 48),
                                         std::pair(DdfVersion::k4, 96),
                                         std::pair(DdfVersion::k4, 48)));

TEST(RecordingTest, ArisFramesComeBack) {
  for (const int beams : {48, 64, 96, 128}) {
    const ByteVector bytes = Aris(beams);
    const SonarRecording recording(bytes);
    EXPECT_EQ(recording.layout().beams, beams);
    EXPECT_EQ(recording.layout().rate_hz, 7.5);
    EXPECT_EQ(recording.Fault(), "");
    const auto frame = recording.Frame(1);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->time, RandomSonarFrame(96, 1).time);
    EXPECT_NEAR(frame->min_range_m, 2.25, 1e-3);
    EXPECT_NEAR(frame->max_range_m, 11.25, 0.05);
  }
}

TEST(RecordingTest, OfACutFileTheWholeFramesLoad) {
  for (const ByteVector& whole : {Ddf(DdfVersion::k4, 48), Aris(48)}) {
    ByteVector bytes = whole;
    bytes.resize(bytes.size() - 10);
    const SonarRecording recording(bytes);
    EXPECT_EQ(recording.size(), kFrames - 1);
    EXPECT_TRUE(recording.Frame(kFrames - 2));
    EXPECT_NE(recording.Fault().find("ends within a frame"), std::string::npos);
    EXPECT_NE(recording.Fault().find("2 of 3 frames"), std::string::npos);
  }
}

TEST(RecordingTest, FramesWithADamagedHeaderAreLeftOut) {
  ByteVector ddf = Ddf(DdfVersion::k4, 48);
  StoreLittle(std::uint32_t{77}, 1024 + 1024 + 48 * 512 + 56, ddf);  // Window length.
  ByteVector aris = Aris(48);
  StoreLittle(std::uint32_t{99}, 1024 + 1024 + 48 * 100 + 436, aris);  // Ping mode.
  for (const ByteVector& bytes : {ddf, aris}) {
    const SonarRecording recording(bytes);
    EXPECT_TRUE(recording.Frame(0));
    EXPECT_FALSE(recording.Frame(1));
    EXPECT_TRUE(recording.Frame(2));
    EXPECT_EQ(recording.Fault(), "1 frames with a damaged header left out");
  }
}

TEST(RecordingTest, WhatIsNoRecordingIsRefused) {
  ByteVector bytes = Ddf(DdfVersion::k4, 48);
  EXPECT_THROW(SonarRecording({}), UsageError);
  EXPECT_THROW(SonarRecording(ByteSpan(bytes).first(1023)), UsageError);
  EXPECT_THROW(SonarRecording(ByteSpan(bytes).first(1024)), UsageError);
  StoreLittle(std::uint32_t{50}, 16, bytes);
  EXPECT_THROW(SonarRecording{bytes}, UsageError);
  bytes[0] = 'x';
  EXPECT_THROW(SonarRecording{bytes}, UsageError);
}

/// Recordings that others made: in VOG_SHARED_DATA, or beside the source tree.
std::filesystem::path SharedData() {
  const char* const given = std::getenv("VOG_SHARED_DATA");
  return given ? std::filesystem::path(given)
               : std::filesystem::path(VOG_SOURCE_DIR) / "../shared/data";
}

TEST(RecordingTest, ReadsARealArisFile) {
  const auto path = SharedData() / "sonar/sample.aris";
  const auto file = MappedFile::Open(path);
  if (!file) GTEST_SKIP() << "no " << path;
  const SonarRecording recording(
      {reinterpret_cast<const std::uint8_t*>(file->bytes().data()), file->bytes().size()});
  EXPECT_EQ(recording.Fault(), "");
  EXPECT_EQ(recording.layout().beams, 48);
  EXPECT_EQ(recording.layout().bins, 2000);
  EXPECT_NEAR(recording.layout().rate_hz, 6.55, 0.01);
  ASSERT_EQ(recording.size(), 6);
  Time last;
  for (int i = 0; i < recording.size(); ++i) {
    const auto frame = recording.Frame(i);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->sequence, i);
    EXPECT_GT(frame->time, last);
    EXPECT_NEAR(frame->min_range_m, 3.3, 0.05);
    EXPECT_NEAR(frame->max_range_m - frame->min_range_m, 20.1, 0.1);
    last = frame->time;
  }
}

}  // namespace
}  // namespace vog
