#include "hardware/sonar/didson_header.h"

#include <gtest/gtest.h>

#include "hardware/sonar/frames_testing.h"

namespace vog {
namespace {

TEST(DidsonHeaderTest, FieldsLieWhereTheFormatSays) {
  DidsonHeader header;
  header.frame_number = 0x04030201;
  header.window_start = 6;
  header.vehicle_time_s = 1468966347.25;
  header.sonar_tilt_deg = -30;
  const ByteVector bytes = EncodeDidsonHeader(header);
  ASSERT_EQ(bytes.size(), kDidsonHeaderBytes);
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(bytes[3], 4);
  EXPECT_EQ(bytes[52], 6);
  EXPECT_EQ(LoadLittle<double>(bytes, 268), 1468966347.25);
  EXPECT_EQ(LoadLittle<float>(bytes, 248), -30);
}

TEST(DidsonHeaderTest, AllBytesOfFieldsComeBack) {
  Random random(1, "header");
  ByteVector bytes(kDidsonHeaderBytes);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.Index(256));
  const ByteVector once = EncodeDidsonHeader(DecodeDidsonHeader(bytes));
  EXPECT_EQ(EncodeDidsonHeader(DecodeDidsonHeader(once)), once);
  int same = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) same += bytes[i] == once[i];
  EXPECT_GT(same, 36 * 4);
}

TEST(DidsonHeaderTest, WindowsOfAllTables) {
  const auto window = [](std::uint32_t mode, std::uint32_t start, std::uint32_t length,
                         std::uint32_t flags, WindowTable table = WindowTable::kFromHeader) {
    DidsonHeader header;
    header.transmit_mode = mode;
    header.window_start = start;
    header.window_length = length;
    header.config_flags = flags;
    return WindowOf(header, table);
  };
  EXPECT_DOUBLE_EQ(window(3, 6, 3, 1)->min_range_m, 2.25);
  EXPECT_DOUBLE_EQ(window(3, 6, 3, 1)->max_range_m, 11.25);
  EXPECT_DOUBLE_EQ(window(2, 6, 0, 1)->min_range_m, 4.5);
  EXPECT_DOUBLE_EQ(window(2, 6, 0, 1)->max_range_m, 9);
  EXPECT_DOUBLE_EQ(window(3, 2, 1, 0)->min_range_m, 0.84);
  EXPECT_DOUBLE_EQ(window(3, 2, 1, 0)->max_range_m, 0.84 + 2.5);
  EXPECT_DOUBLE_EQ(window(2, 1, 3, 0)->max_range_m, 0.84 + 40);
  EXPECT_DOUBLE_EQ(window(3, 6, 3, 0, WindowTable::kClassic)->min_range_m, 2.25);
  EXPECT_DOUBLE_EQ(window(3, 6, 3, 1, WindowTable::kExtended)->max_range_m, 6 * 0.42 + 10);
  EXPECT_FALSE(window(3, 32, 3, 1));
  EXPECT_FALSE(window(3, 6, 4, 1));
}

TEST(DidsonHeaderTest, TimeIsTheVehiclesElseTheCalendars) {
  DidsonHeader header;
  EXPECT_EQ(TimeOf(header), Time());
  header.year = 2016;
  header.month = 7;
  header.day = 19;
  header.hour = 22;
  header.minute = 12;
  header.second = 27;
  header.hundredths = 25;
  EXPECT_EQ(ToUtime(TimeOf(header)), 1'468'966'347'250'000);
  header.vehicle_time_s = 1e9;
  EXPECT_EQ(ToUtime(TimeOf(header)), 1'000'000'000'000'000);
  header.vehicle_time_s = std::numeric_limits<double>::quiet_NaN();
  header.month = 13;
  EXPECT_EQ(TimeOf(header), Time());
}

TEST(DidsonHeaderTest, FramesGoThereAndBack) {
  for (const int beams : {96, 48}) {
    const SonarFrame frame = RandomSonarFrame(beams, 7);
    const auto back = ToSonarFrame(RandomDidsonFrame(beams, 7));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->time, frame.time);
    EXPECT_EQ(back->sequence, 7);
    EXPECT_NEAR(back->tilt_rad, frame.tilt_rad, 1e-6);
    EXPECT_DOUBLE_EQ(back->min_range_m, frame.min_range_m);
    EXPECT_DOUBLE_EQ(back->max_range_m, frame.max_range_m);
    EXPECT_EQ(back->beams, beams);
    EXPECT_EQ(back->samples, frame.samples);
  }
}

TEST(DidsonHeaderTest, WindowsThatTheSonarDoesNotHaveAreRefused) {
  SonarFrame frame = RandomSonarFrame(96, 0);
  frame.max_range_m += 0.1;
  EXPECT_FALSE(FromSonarFrame(frame));
  frame = RandomSonarFrame(96, 0);
  frame.min_range_m = 0.42;
  frame.max_range_m = 5.42;
  EXPECT_EQ(FromSonarFrame(frame)->header.config_flags, 0u);
  frame.samples.pop_back();
  EXPECT_FALSE(FromSonarFrame(frame));
}

}  // namespace
}  // namespace vog
